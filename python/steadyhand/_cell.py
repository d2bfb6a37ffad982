"""Obstacles around an arm."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Sequence
from typing import Any

from numpy.typing import ArrayLike

from . import _native
from ._arrays import Array, array, number, text
from ._documented import document
from ._robot import Robot, opened


class Object:
    """An obstacle. Make it with sphere(), capsule(), cylinder(), box() or half_space(). They share these arguments:

    name: unique in its cell; messages use it.
    T_base_object: (4, 4), pose of its centre in the base frame, m (steadyhand.pose makes one from a position).
    velocity: (3,), m/s, in the base frame. Plans assume that it stays constant and that the object does not turn.
    margin: m, 0 to 1: the smallest distance that plans keep.
    may_be_touched_by: names of bodies or links of the arm for which it is no obstacle.

    Raises ValueError or TypeError for a wrong shape or numbers that are not finite. Other invalid values (a radius of 0, a name
    used twice, more than 64 objects, an unknown link) raise SteadyhandError where the object is used.
    """

    def __init__(
        self,
        name: str,
        shape: str,
        sizes: dict[str, float],
        T_base_object: ArrayLike,
        velocity: ArrayLike,
        margin: float,
        may_be_touched_by: Sequence[str],
    ) -> None:
        self.name: str = text("the name of an object", name)
        self.shape: str = shape
        """"sphere", "capsule", "cylinder", "box" or "half_space"."""
        self.sizes: dict[str, float] = {key: number(f"{name}: {key}", size) for key, size in sizes.items()}
        """Sizes in m, by name."""
        self.T_base_object: Array = array(f"{name}: T_base_object", T_base_object, (4, 4))
        self.velocity: Array = array(f"{name}: velocity", velocity, (3,))
        self.margin: float = number(f"{name}: margin", margin)
        if isinstance(may_be_touched_by, str):
            raise TypeError(f"{name}: may_be_touched_by must be a list of names, not {may_be_touched_by!r}")
        self.may_be_touched_by: tuple[str, ...] = tuple(text(f"{name}: may_be_touched_by", each) for each in may_be_touched_by)

    @classmethod
    def sphere(
        cls, name: str, T_base_object: ArrayLike, radius: float, *,
        velocity: ArrayLike = (0.0, 0.0, 0.0), margin: float = 0.01, may_be_touched_by: Sequence[str] = (),
    ) -> Object:  # fmt: skip
        """A sphere. radius: m."""
        return cls(name, "sphere", {"radius": radius}, T_base_object, velocity, margin, may_be_touched_by)

    @classmethod
    def capsule(
        cls, name: str, T_base_object: ArrayLike, radius: float, length: float, *,
        velocity: ArrayLike = (0.0, 0.0, 0.0), margin: float = 0.01, may_be_touched_by: Sequence[str] = (),
    ) -> Object:  # fmt: skip
        """A capsule along its z axis. radius: m; length: m, of the axis, without the two hemispheres."""
        return cls(name, "capsule", {"radius": radius, "length": length}, T_base_object, velocity, margin, may_be_touched_by)

    @classmethod
    def cylinder(
        cls, name: str, T_base_object: ArrayLike, radius: float, length: float, *,
        velocity: ArrayLike = (0.0, 0.0, 0.0), margin: float = 0.01, may_be_touched_by: Sequence[str] = (),
    ) -> Object:  # fmt: skip
        """A cylinder along its z axis. radius, length: m."""
        return cls(name, "cylinder", {"radius": radius, "length": length}, T_base_object, velocity, margin, may_be_touched_by)

    @classmethod
    def box(
        cls, name: str, T_base_object: ArrayLike, size: ArrayLike, rounding: float = 0.0, *,
        velocity: ArrayLike = (0.0, 0.0, 0.0), margin: float = 0.01, may_be_touched_by: Sequence[str] = (),
    ) -> Object:  # fmt: skip
        """A box. size: (3,), m, along its x, y, z. rounding: m, radius of its edges, included in the size."""
        x, y, z = array(f"{name}: size", size, (3,)).tolist()
        return cls(name, "box", {"x": x, "y": y, "z": z, "rounding": rounding}, T_base_object, velocity, margin, may_be_touched_by)

    @classmethod
    def half_space(
        cls, name: str, T_base_object: ArrayLike, *,
        velocity: ArrayLike = (0.0, 0.0, 0.0), margin: float = 0.01, may_be_touched_by: Sequence[str] = (),
    ) -> Object:  # fmt: skip
        """All points with z <= 0 in its frame; eye(4) gives a table top at the height of the base."""
        return cls(name, "half_space", {}, T_base_object, velocity, margin, may_be_touched_by)

    def __repr__(self) -> str:
        return f"<steadyhand.Object {self.name!r}, {self.shape}>"


class Cell:
    """The obstacles around an arm, at most 64.

    what: a built-in cell ("table", "pedestal", "none"), the path of a cell file (docs/how-to/add-a-table.md), or a list of Object.
    Raises SteadyhandError (a ValueError) for an unknown name (the message lists the valid ones) and for an invalid file;
    FileNotFoundError for a path that does not exist.

    >>> ball = Object.sphere("ball", steadyhand.pose([0.5, 0.2, 0.3]), radius=0.1)
    >>> planner = Planner("ur5e", cell=[ball])
    """

    def __init__(self, what: str | os.PathLike[str] | Iterable[Object]) -> None:
        if isinstance(what, (str, os.PathLike)):
            self._native = opened("cell", what, _native.Cell.open)
        else:
            self._native = _native.Cell()
            for each in what:
                if not isinstance(each, Object):
                    raise TypeError(f"a cell is made of steadyhand.Object, not of {type(each).__name__}")
                self._native.add(
                    each.name, each.shape, list(each.sizes.values()), each.T_base_object, each.velocity, each.margin,
                    list(each.may_be_touched_by),
                )  # fmt: skip
        self.name: str = self._native.name
        """Name in its file; empty if it has none."""
        self.object_names: tuple[str, ...] = tuple(self._native.names)

    @property
    def description(self) -> dict[str, Any]:
        """Name and objects, in the form of recordings and messages (docs/reference/protocol.md)."""
        return json.loads(self._native.json)

    def attach(self, name: str, robot: Robot, q: ArrayLike) -> Cell:
        """Returns this cell with the object attached to the tool, at its pose relative to the tool at q. It then moves with the tool,
        and keeps its distance from other objects and from the arm's bodies that are not on the tool's link.

        q: (n,), rad (m). Raises SteadyhandError for an unknown name, an object that is already attached, a half-space, or an
        object that overlaps a body of the arm that must not touch it.

        >>> planner.set_cell(cell.attach("bottle", planner.robot, plan.q[0]), t)
        """
        return self._changed(self._native.attach, name, robot, q)

    def detach(self, name: str, robot: Robot, q: ArrayLike) -> Cell:
        """Returns this cell with the object released at its pose at q, (n,), rad (m). Raises SteadyhandError if it is not attached."""
        return self._changed(self._native.detach, name, robot, q)

    def _changed(self, change: Any, name: str, robot: Robot, q: ArrayLike) -> Cell:
        q = array("q", q, (robot.dof,), what=f"one number for each joint of {robot.name}")
        changed = Cell([])
        changed._native = change(text("name", name), robot._native, q)
        changed.name, changed.object_names = self.name, self.object_names
        return changed

    def distances(self, robot: Robot, q: ArrayLike) -> dict[str, float]:
        """Distances in m at q, by name of the object, without its margin, to the nearest body of the arm that must not touch it. They
        are negative on overlap, and infinite if every body may touch the object. For an attached object: to the arm's bodies.

        q: (n,), rad (m). Raises SteadyhandError if the cell does not fit the robot.
        """
        return self._native.distances(robot._native, array("q", q, (robot.dof,), what=f"one number for each joint of {robot.name}"))

    def __repr__(self) -> str:
        return f"<steadyhand.Cell {self.name!r}, {len(self.object_names)} objects>"


CellLike = Cell | str | os.PathLike[str] | Iterable[Object]
"""A Cell, or an argument of Cell()."""


def as_cell(cell: CellLike) -> Cell:
    return cell if isinstance(cell, Cell) else Cell(cell)


document(globals())
