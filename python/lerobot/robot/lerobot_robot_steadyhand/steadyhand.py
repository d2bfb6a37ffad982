"""The arm, as LeRobot's loops see it."""

from functools import cached_property
from typing import Any

import numpy as np
import steadyhand
from lerobot.cameras.utils import make_cameras_from_configs
from lerobot.robots.robot import Robot
from steadyhand.policies import Action, Link

from .config_steadyhand import SteadyhandRobotConfig

POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")


class SteadyhandRobot(Robot):
    """Observes measured joints and the tool's pose; an action is where the tool is to be, in the base, x, y, z in m and quaternion.
    With two tools, names of their values begin with the tool's, as those of LeRobot's bi_* robots: left_tool.x, left_gripper.pos.

    What is sent leads in the policy's turn only, through steadyhand's checks; while a person leads, it does nothing. Names are those
    of steadyhand's data sets with `--action pose`.
    """

    config_class = SteadyhandRobotConfig
    name = "steadyhand"

    def __init__(self, config: SteadyhandRobotConfig) -> None:
        super().__init__(config)
        self.config = config
        self.cameras = make_cameras_from_configs(config.cameras)
        robot = steadyhand.Robot(config.robot)
        self._joints = robot.joint_names
        self._tools = [""] if robot.tool_count == 1 else [f"{name}_" for name in robot.tool_names]
        self._link: Link | None = None

    @cached_property
    def _gripper(self) -> dict[str, type]:
        return {f"{of}gripper.pos": float for of in self._tools if self.config.gripper}

    @cached_property
    def _poses(self) -> dict[str, type]:
        return {f"{of}tool.{name}": float for of in self._tools for name in POSE}

    @cached_property
    def observation_features(self) -> dict[str, Any]:
        joints = {f"{joint}.{kind}": float for kind in ("pos", "vel") for joint in self._joints}
        cameras = {name: (camera.height, camera.width, 3) for name, camera in self.config.cameras.items()}
        return joints | self._gripper | self._poses | cameras

    @cached_property
    def action_features(self) -> dict[str, type]:
        return self._poses | self._gripper

    @property
    def is_connected(self) -> bool:
        return self._link is not None and self._link.alive and all(camera.is_connected for camera in self.cameras.values())

    def connect(self, calibrate: bool = True) -> None:
        self._link = Link(self.config.port, policy="lerobot", period=1 / self.config.fps)
        for camera in self.cameras.values():
            camera.connect()
        if self.config.turn:
            self._link.take_turn()

    @property
    def is_calibrated(self) -> bool:
        return True

    def calibrate(self) -> None:
        """Its joints know where they are."""

    def configure(self) -> None:
        """All is set at steadyhand's page."""

    def _linked(self) -> Link:
        if self._link is None:
            raise ConnectionError(f"{self} is not connected")
        return self._link

    def get_observation(self) -> dict[str, Any]:
        seen = self._linked().observe()
        if len(seen.q) != len(self._joints):
            raise ValueError(f"the arm that steadyhand leads has {len(seen.q)} joints; --robot.robot is {self.config.robot}, with {len(self._joints)}")
        grippers = seen.gripper if isinstance(seen.gripper, tuple) else (seen.gripper,)
        if len(grippers) != len(self._tools):
            raise ValueError(f"the robot that steadyhand leads has {len(grippers)} tools; --robot.robot is {self.config.robot}, with {len(self._tools)}")
        if any(self.config.gripper != (gripper is not None) for gripper in grippers):
            raise ValueError(f"the arm that steadyhand leads has {'no' if self.config.gripper else 'a'} gripper; --robot.gripper says otherwise")
        values = {f"{joint}.pos": float(q) for joint, q in zip(self._joints, seen.q)} | {f"{joint}.vel": float(dq) for joint, dq in zip(self._joints, seen.dq)}
        if self.config.gripper:
            values |= {f"{of}gripper.pos": float(gripper or 0.0) for of, gripper in zip(self._tools, grippers)}
        poses = [number for T in seen.T_base_tool.reshape(-1, 4, 4) for number in (*T[:3, 3], *steadyhand.quat_xyzw(T))]
        pictures = {name: camera.async_read() for name, camera in self.cameras.items()}
        return values | {name: float(value) for name, value in zip(self._poses, poses)} | pictures

    def send_action(self, action: dict[str, Any]) -> dict[str, Any]:
        missing = [name for name in self.action_features if name not in action]
        if missing:
            raise ValueError(f"the action has no {', '.join(missing)}")
        poses = []
        for of in self._tools:
            values = [float(action[f"{of}tool.{name}"]) for name in POSE]
            length = sum(value * value for value in values[3:]) ** 0.5
            if not 0.5 < length < 2.0:
                raise ValueError(f"the action's quaternion {of}tool.q is of length {length:.3g}; it must be 1")
            poses.append(steadyhand.pose(values[:3], [value / length for value in values[3:]]))
        grippers = tuple(float(action[name]) for name in self._gripper) or None
        self._linked().act(Action(np.array(poses), grippers))
        return action

    def disconnect(self) -> None:
        if self._link is not None:
            self._link.close()
            self._link = None
        for camera in self.cameras.values():
            camera.disconnect()
