"""The baseline: differential inverse kinematics, as most VR teleoperation solves it. In simulation only.

Each pose of the hand is a target for the tool; damped least squares (Nakamura & Hanafusa 1986) finds joints for it that are near the
last ones; a first-order low-pass smooths them; speeds and accelerations are cut at the robot's limits. There is no horizon: it knows
neither liquid nor collisions, and brakes only once a limit is reached.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import Array
from .._robot import Robot
from .._stages import Retargeter

DAMPING = 0.03
ITERATIONS = 8
SMOOTHING = 0.05  # s, time constant of the low-pass


def solve(robot: Robot, T_base_tool: Array, q: Array, iterations: int = ITERATIONS, damping: float = DAMPING) -> Array:
    """Joints (n,), rad (m), inside their limits and near q, whose tools are near T_base_tool: (4, 4), or one for each, (tools, 4, 4)."""
    q, wanted = q.copy(), T_base_tool.reshape(-1, 4, 4)
    for _ in range(iterations):
        error = np.concatenate([_twist(robot.fk(q, tool), T) for tool, T in enumerate(wanted)])
        if np.abs(error).max() < 1e-6:
            break
        J = np.vstack([robot.jacobian(q, tool) for tool in range(len(wanted))])
        q += J.T @ np.linalg.solve(J @ J.T + damping**2 * np.eye(len(error)), error)
        q = np.clip(q, robot.position_min, robot.position_max)
    return q


def _twist(T: Array, wanted: Array) -> Array:
    """(6,), m and rad, base axes: from pose T to the one that is wanted."""
    R = wanted[:3, :3] @ T[:3, :3].T
    turn = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return np.concatenate([wanted[:3, 3] - T[:3, 3], turn])


class OneInstantIk:
    """In the place of a Pipeline: feed(), update(), targets, reset(). update() is called with even steps of time."""

    def __init__(self, robot: Robot, scale: float) -> None:
        self.robot, self._scale = robot, scale
        self.reset()

    def reset(self, q: ArrayLike | None = None, t: float = 0.0) -> None:
        self._retargeters = [Retargeter(self._scale, yaw=0.0) for _ in range(self.robot.tool_count)]
        self._q = self.robot.home.copy() if q is None else np.array(q, dtype=float)
        self._dq = np.zeros(self.robot.dof)
        self._wanted, self._t = self._q.copy(), t
        self.targets: Array = np.array([self.robot.fk(self._q, tool) for tool in range(self.robot.tool_count)])
        """T_base_tool (tools, 4, 4), where the newest hands want the tools."""
        self.held_back = "none"
        """What cut the last command: "velocity", "acceleration", "position" or "none"."""

    def feed(self, T_operator_hand: Array, t: float, clutch: bool = True, tool: int = 0) -> None:
        """The hand at time t, as Pipeline.feed()."""
        self.targets[tool], engaged = self._retargeters[tool].update(T_operator_hand, t, self.robot.fk(self._q, tool), clutch)
        if engaged:
            self._wanted = solve(self.robot, self.targets, self._wanted)

    def update(self, t: float) -> tuple[Array, Array, Array]:
        """q, dq, ddq at time t, as Pipeline.update()."""
        dt = t - self._t
        if dt <= 0.0:
            return self._q.copy(), self._dq.copy(), np.zeros(self.robot.dof)
        robot = self.robot
        wanted = (self._wanted - self._q) / max(SMOOTHING, dt)
        dq = np.clip(wanted, -robot.velocity_max, robot.velocity_max)
        ddq = np.clip((dq - self._dq) / dt, -robot.acceleration_max, robot.acceleration_max)
        self.held_back = "none"
        if np.any(np.abs(wanted) > robot.velocity_max):
            self.held_back = "velocity"
        if np.any(np.abs((dq - self._dq) / dt) > robot.acceleration_max):
            self.held_back = "acceleration"
        dq = self._dq + ddq * dt
        q = self._q + 0.5 * (self._dq + dq) * dt
        over = (q < robot.position_min) | (q > robot.position_max)
        if over.any():
            self.held_back = "position"
            q = np.clip(q, robot.position_min, robot.position_max)
            dq = np.where(over, 0.0, dq)
        self._q, self._dq, self._t = q, dq, t
        return q.copy(), dq.copy(), ddq
