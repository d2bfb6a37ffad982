"""Robots: kinematics, limits and distances."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _native
from ._arrays import Array, array, text
from ._documented import document


def opened(kind: str, name: str | os.PathLike[str], open: Any) -> Any:
    """open(name), with FileNotFoundError and the same message for a missing file."""
    if not isinstance(name, (str, os.PathLike)):
        raise TypeError(f"{kind} must be a name or the path of a file, not {type(name).__name__}")
    path = Path(text(f"the name of the {kind}", os.fspath(name)))
    try:
        return open(os.fspath(name))
    except _native.SteadyhandError as error:
        always = kind in ("recording", "session")  # have no short names
        if (always or path.suffix or len(path.parts) > 1) and not path.is_file():
            raise FileNotFoundError(str(error)) from None
        raise


class Robot:
    """Model of a robot with 1 to 16 joints: kinematics, tool, limits and collision bodies. It does not change.

    `name`: a built-in robot ("ur5e"), or the path of a robot file (docs/how-to/add-a-robot.md) or URDF. A URDF's tool is the end of
    its longest chain, its home the middle of its limits, and it has no bodies.

    Units: rad for revolute joints, m for prismatic ones, s. Frames: **base** is the URDF's base link, z up; **tool** is the tool
    frame (TCP). With a glass its origin is at the centre, and z points along its axis out of the opening.

    Raises SteadyhandError (a ValueError) for an unknown name (the message lists the valid ones) and for an invalid file;
    FileNotFoundError for a path that does not exist.

    >>> robot = Robot("ur5e")
    >>> robot.fk(robot.home).shape
    (4, 4)
    """

    def __init__(self, name: str | os.PathLike[str]) -> None:
        self._native = opened("robot", name, _native.Robot.open)
        self.source = os.fspath(name)
        """Name or path that it was opened with."""
        self.description: dict[str, Any] = json.loads(self._native.json)
        """Output of the command `steadyhand describe`: joints, tool, limits, bodies, pairs."""
        self.name: str = self.description["name"]
        self.joint_names: tuple[str, ...] = tuple(joint["name"] for joint in self.description["joints"])
        """n names, from the base."""
        self.joint_units: tuple[str, ...] = tuple("rad" if joint["type"] == "revolute" else "m" for joint in self.description["joints"])
        """n of "rad" or "m"."""
        self.tool_names: tuple[str, ...] = tuple(tool["name"] for tool in self.description["tools"])
        """One for each arm: index k of these is tool k."""

        def limit(key: str) -> Array:
            values = np.array(self.description[key], dtype=np.float64)
            values.flags.writeable = False
            return values

        self.home = limit("home")
        """(n,), rad (m): start position of planners."""
        self.position_min = limit("position_min")
        """(n,), rad (m)."""
        self.position_max = limit("position_max")
        """(n,), rad (m)."""
        self.velocity_max = limit("velocity_max")
        """(n,), rad/s (m/s)."""
        self.acceleration_max = limit("acceleration_max")
        """(n,), rad/s^2 (m/s^2)."""
        self.doubts: tuple[str, ...] = tuple(self._native.doubts)
        """Warnings about missing or doubtful parts of the model."""

    @property
    def dof(self) -> int:
        """n, the number of joints."""
        return len(self.joint_names)

    @property
    def tool_count(self) -> int:
        """How many tools: one for each arm."""
        return len(self.tool_names)

    def __reduce__(self) -> tuple[type[Robot], tuple[str]]:
        """Pickles the name or path, so that results with a robot can go to files and other processes."""
        return Robot, (self.source,)

    def __repr__(self) -> str:
        return f"<steadyhand.Robot {self.name!r}, {self.dof} joints, {len(self.description['bodies'])} bodies>"

    def fk(self, q: ArrayLike, tool: int = 0) -> Array:
        """Forward kinematics: T_base_tool at q.

        q: (n,), rad (m), or (m, n). tool: index into tool_names. Returns (4, 4), or (m, 4, 4); position in m.
        """
        tool = self._tool(tool)
        return self._each(lambda row: self._native.fk(row, tool), q)

    def jacobian(self, q: ArrayLike, tool: int = 0) -> Array:
        """Jacobian of the tool at q: its twist is jacobian(q) @ dq.

        Rows 0 to 2: linear velocity of the tool's origin, m/s. Rows 3 to 5: angular velocity, rad/s. Both are in base axes
        (Pinocchio's LOCAL_WORLD_ALIGNED). Columns: the joints.
        q: (n,), rad (m), or (m, n). tool: index into tool_names. Returns (6, n), or (m, 6, n).
        """
        tool = self._tool(tool)
        return self._each(lambda row: self._native.jacobian(row, tool), q)

    def clearance(self, q: ArrayLike) -> Any:
        """Smallest distance between the arm's bodies, over all pairs, m. It is negative on overlap, infinite without bodies.

        q: (n,), rad (m), or (m, n). Returns a float, or (m,).
        """
        return self._each(self._native.clearance, q)

    def body_centers(self, q: ArrayLike) -> Array:
        """Centres of the collision bodies in the base, m, in the order of description["bodies"].

        q: (n,) rad (m), or (m, n). Returns (b, 3), or (m, b, 3).
        """
        return self._each(self._native.body_centers, q)

    def local_acceleration(self, q: ArrayLike, dq: ArrayLike, ddq: ArrayLike, tool: int = 0) -> Array:
        """Specific force R'(p'' + g) at the tool, in the tool frame, m/s^2: the reading of an accelerometer there. It is (0, 0, 9.81)
        at rest and upright.

        q, dq, ddq: (n,), rad, rad/s, rad/s^2 (m, ...), or (m, n). tool: index into tool_names. Returns (3,), or (m, 3).
        """
        tool = self._tool(tool)
        q = self._joints("q", q)
        dq, ddq = (array(name, value, q.shape, what="as q") for name, value in (("dq", dq), ("ddq", ddq)))
        if q.ndim == 1:
            return self._native.local_acceleration(q, dq, ddq, tool)
        return np.array([self._native.local_acceleration(*row, tool) for row in zip(q, dq, ddq)]).reshape(-1, 3)

    def reach(self, tool: int = 0) -> tuple[Array, float]:
        """A ball that contains every reachable position of a tool: centre (3,) in the base frame, and radius, m. Takes about 50 ms."""
        return self._native.reach(self._tool(tool))

    def _tool(self, tool: int) -> int:
        """A valid index."""
        if isinstance(tool, bool) or not isinstance(tool, (int, np.integer)):
            raise TypeError(f"tool must be an index into {self.tool_names}, not {type(tool).__name__}")
        if not 0 <= tool < self.tool_count:
            raise ValueError(f"tool is {tool}; {self.name} has the tools {', '.join(f'{i} ({name})' for i, name in enumerate(self.tool_names))}")
        return int(tool)

    def _joints(self, name: str, value: ArrayLike) -> Array:
        n = self.dof
        return array(name, value, (n,), ("m", n), what=f"one number for each joint of {self.name}")

    def _each(self, function: Any, q: ArrayLike) -> Any:
        q = self._joints("q", q)
        if q.ndim == 1:
            return function(q)
        return np.array([function(row) for row in q]) if len(q) else np.empty((0, *np.shape(function(self.home))))


def as_robot(robot: Robot | str | os.PathLike[str]) -> Robot:
    return robot if isinstance(robot, Robot) else Robot(robot)


document(globals())
