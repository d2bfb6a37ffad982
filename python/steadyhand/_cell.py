"""What stands around an arm."""

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
    """Something solid that the arm keeps clear of. Made by sphere(), capsule(), cylinder(), box() or half_space(), which take

    name: for messages; each object of a cell has its own.
    T_base_object: (4, 4), where it is in the arm's base (steadyhand.pose makes one of a position); m. It is its centre.
    velocity: (3,), m/s in the base: it goes on so, and plans know where it will be. It does not turn.
    margin: m, 0 to 1: how far the arm stays away.
    may_be_touched_by: names of bodies or links of the arm that may be in it.

    Raises ValueError and TypeError for what has another shape or is not finite; what cannot be (a radius of 0, a second object
    of its name, more than 64, a link that the arm does not have) is a SteadyhandError where the object is used.
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
        """m, by name."""
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
        """radius: m."""
        return cls(name, "sphere", {"radius": radius}, T_base_object, velocity, margin, may_be_touched_by)

    @classmethod
    def capsule(
        cls, name: str, T_base_object: ArrayLike, radius: float, length: float, *,
        velocity: ArrayLike = (0.0, 0.0, 0.0), margin: float = 0.01, may_be_touched_by: Sequence[str] = (),
    ) -> Object:  # fmt: skip
        """Along its z. radius: m; length: m, without the two ends, which are half spheres."""
        return cls(name, "capsule", {"radius": radius, "length": length}, T_base_object, velocity, margin, may_be_touched_by)

    @classmethod
    def cylinder(
        cls, name: str, T_base_object: ArrayLike, radius: float, length: float, *,
        velocity: ArrayLike = (0.0, 0.0, 0.0), margin: float = 0.01, may_be_touched_by: Sequence[str] = (),
    ) -> Object:  # fmt: skip
        """Along its z. radius: m; length: m."""
        return cls(name, "cylinder", {"radius": radius, "length": length}, T_base_object, velocity, margin, may_be_touched_by)

    @classmethod
    def box(
        cls, name: str, T_base_object: ArrayLike, size: ArrayLike, rounding: float = 0.0, *,
        velocity: ArrayLike = (0.0, 0.0, 0.0), margin: float = 0.01, may_be_touched_by: Sequence[str] = (),
    ) -> Object:  # fmt: skip
        """size: (3,), m, along its x, y, z. rounding: m, radius of its edges, inside of that size."""
        x, y, z = array(f"{name}: size", size, (3,)).tolist()
        return cls(name, "box", {"x": x, "y": y, "z": z, "rounding": rounding}, T_base_object, velocity, margin, may_be_touched_by)

    @classmethod
    def half_space(
        cls, name: str, T_base_object: ArrayLike, *,
        velocity: ArrayLike = (0.0, 0.0, 0.0), margin: float = 0.01, may_be_touched_by: Sequence[str] = (),
    ) -> Object:  # fmt: skip
        """All that has z <= 0 in its frame: a table top, with eye(4) one at the arm's base."""
        return cls(name, "half_space", {}, T_base_object, velocity, margin, may_be_touched_by)

    def __repr__(self) -> str:
        return f"<steadyhand.Object {self.name!r}, {self.shape}>"


class Cell:
    """What stands around an arm: at most 64 objects.

    what: a cell that steadyhand has ("table", "pedestal", "none"), the path of a cell file (docs/how-to/add-a-table.md), or Objects.
    Raises SteadyhandError (a ValueError) for an unknown name, listing those that there are, and for a file that is refused, with
    the reason; FileNotFoundError for a path where nothing is.

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
        """Of its file; empty if it has none."""
        self.object_names: tuple[str, ...] = tuple(self._native.names)

    @property
    def description(self) -> dict[str, Any]:
        """Name and objects as recordings and the page have them (docs/reference/protocol.md)."""
        return json.loads(self._native.json)

    def attach(self, name: str, robot: Robot, q: ArrayLike) -> Cell:
        """This cell with the object in the tool, where it is in it at q: from then on a part of the arm, which moves with the
        tool and is kept off the other objects and off the arm's bodies that are not on the tool's link.

        q: (n,) rad (m). Raises SteadyhandError for a name that the cell does not have, what is carried already, a half-space,
        and what overlaps a body of the arm that must not touch it.

        >>> planner.set_cell(cell.attach("bottle", planner.robot, plan.q[0]), t)
        """
        return self._changed(self._native.attach, name, robot, q)

    def detach(self, name: str, robot: Robot, q: ArrayLike) -> Cell:
        """This cell with the object out of the tool again, where it is at q. Raises SteadyhandError for what is not carried."""
        return self._changed(self._native.detach, name, robot, q)

    def _changed(self, change: Any, name: str, robot: Robot, q: ArrayLike) -> Cell:
        q = array("q", q, (robot.dof,), what=f"one number for each joint of {robot.name}")
        changed = Cell([])
        changed._native = change(text("name", name), robot._native, q)
        changed.name, changed.object_names = self.name, self.object_names
        return changed

    def distances(self, robot: Robot, q: ArrayLike) -> dict[str, float]:
        """By name of the object: m from it, without its margin, to the nearest body of the arm that must not touch it; negative
        by the depth where they overlap, infinite where all may. Of what is carried: to the arm's own bodies.

        q: (n,) rad (m). Raises SteadyhandError where the cell does not fit the robot.
        """
        return self._native.distances(robot._native, array("q", q, (robot.dof,), what=f"one number for each joint of {robot.name}"))

    def __repr__(self) -> str:
        return f"<steadyhand.Cell {self.name!r}, {len(self.object_names)} objects>"


CellLike = Cell | str | os.PathLike[str] | Iterable[Object]
"""A cell, or what Cell() takes."""


def as_cell(cell: CellLike) -> Cell:
    return cell if isinstance(cell, Cell) else Cell(cell)


document(globals())
