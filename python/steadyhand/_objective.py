"""Objectives of the optimal control problem that are written in Python."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, ClassVar

import numpy as np

from . import _native
from ._arrays import Array, array, number, text
from ._documented import document
from ._robot import Robot


class Node:
    """One node of the horizon, as a term sees it."""

    __slots__ = ("robot", "q", "dq", "ddq", "T_reference", "_T")

    def __init__(self, robot: Robot, q: Array, dq: Array, ddq: Array | None, T_reference: Array) -> None:
        self.robot = robot
        self.q = q
        """(n,), rad (m)."""
        self.dq = dq
        """(n,), rad/s (m/s)."""
        self.ddq = ddq
        """(n,), rad/s^2 (m/s^2); None for a term that acts on states."""
        self.T_reference = T_reference
        """(4, 4), where the tool shall be, in the base, m."""
        self._T: Array | None = None

    @property
    def T_base_tool(self) -> Array:
        """(4, 4), where the tool is, in the base, m."""
        if self._T is None:
            self._T = self.robot._native.fk(self.q)
        return self._T

    @property
    def jacobian(self) -> Array:
        """(6, n), as Robot.jacobian()."""
        return self.robot._native.jacobian(self.q)

    @property
    def local_acceleration(self) -> Array:
        """(3,), m/s^2, as Robot.local_acceleration(); of terms that act on intervals."""
        return self.robot._native.local_acceleration(self.q, self.dq, self.ddq)

    @property
    def z(self) -> Array:
        """(3n,): [q; dq; ddq], by which derivatives are taken; ddq is 0 for a term that acts on states."""
        return np.concatenate([self.q, self.dq, np.zeros_like(self.q) if self.ddq is None else self.ddq])

    def moved_to(self, z: Array) -> Node:
        """The node with other q, dq, ddq."""
        q, dq, ddq = np.split(z, 3)
        return Node(self.robot, q, dq, None if self.ddq is None else ddq, self.T_reference)


class Objective:
    """A term of the objective, of your own: inherit, and write value(). What the planner minimises is the sum over the horizon of
    dt times all terms; a term is linear in its weights, which Planner(weights={name: ...}) gives, or 0.

    name: lower-case letters, digits and underscores. weight_count: how many weights it has; 0: one for each joint.
    acts_on: "intervals", nodes k = 0..N-1 with ddq, or "states", nodes k = 1..N without. unit: of a weight, for people.

    Without gradient() and hessian() of your own, differences stand in, which is slower still and less exact. Python is called
    for each node in each iteration: such a planner is for trying terms, not for a real-time loop (docs/python.md has figures).

    What it raises ends the planner's call; the planner goes on from its last good plan.

    >>> class Upright(Objective):
    ...     name, acts_on = "upright", "states"
    ...     def value(self, node, weight):
    ...         return weight[0] * (1.0 - node.T_base_tool[2, 2])
    >>> planner = Planner("ur5e", objectives=[Upright()], weights={"upright": 10.0})
    """

    name: ClassVar[str] = ""
    weight_count: ClassVar[int] = 1
    acts_on: ClassVar[str] = "intervals"
    unit: ClassVar[str] = "1"

    def value(self, node: Node, weight: Array) -> float:
        """The term at a node, for weights (weight_count,)."""
        raise NotImplementedError(f"{type(self).__name__} has no value(node, weight)")

    def gradient(self, node: Node, weight: Array) -> Array:
        """(3n,): its derivative by z = [q; dq; ddq]."""
        return _differences(lambda z: self.value(node.moved_to(z), weight), node.z, 1e-6, self._free(node))

    def hessian(self, node: Node, weight: Array) -> Array:
        """(3n, 3n): its second derivative by z; symmetric."""
        free = self._free(node)
        if type(self).gradient is not Objective.gradient:
            H = _differences(lambda z: self.gradient(node.moved_to(z), weight), node.z, 1e-6, free)
            return (H + H.T) / 2
        return _second_differences(lambda z: self.value(node.moved_to(z), weight), node.z, 1e-4, free)

    @staticmethod
    def _free(node: Node) -> int:
        """How many entries of z the term may depend on."""
        return len(node.q) * (2 if node.ddq is None else 3)


def _differences(function: Callable[[Array], Any], z: Array, h: float, free: int) -> Array:
    columns = []
    for i in range(free):
        step = np.zeros_like(z)
        step[i] = h
        columns.append((np.asarray(function(z + step)) - np.asarray(function(z - step))) / (2 * h))
    result = np.zeros(np.shape(columns[0]) + (len(z),))
    result[..., :free] = np.stack(columns, axis=-1)
    return result


def _second_differences(function: Callable[[Array], float], z: Array, h: float, free: int) -> Array:
    H, steps, middle = np.zeros((len(z), len(z))), h * np.eye(len(z)), function(z)
    ahead = [function(z + steps[i]) for i in range(free)]
    behind = [function(z - steps[i]) for i in range(free)]
    for i in range(free):
        H[i, i] = (ahead[i] - 2 * middle + behind[i]) / h**2
        for j in range(i):
            both = function(z + steps[i] + steps[j]) + function(z - steps[i] - steps[j])
            H[i, j] = H[j, i] = (both - ahead[i] - ahead[j] - behind[i] - behind[j] + 2 * middle) / (2 * h**2)
    return H


class _Bound:
    """A term of one robot, as the library calls it; looks at what the term answers."""

    def __init__(self, objective: Objective, robot: Robot) -> None:
        self.objective, self.robot, self.where = objective, robot, f"objective {objective.name!r}"

    def value(self, q: Array, dq: Array, ddq: Array | None, T_reference: Array, weight: Array) -> float:
        return number(f"{self.where}: value", self.objective.value(Node(self.robot, q, dq, ddq, T_reference), weight))

    def gradient(self, q: Array, dq: Array, ddq: Array | None, T_reference: Array, weight: Array) -> Array:
        gradient = self.objective.gradient(Node(self.robot, q, dq, ddq, T_reference), weight)
        return array(f"{self.where}: gradient", gradient, (3 * len(q),), what="by [q; dq; ddq]")

    def hessian(self, q: Array, dq: Array, ddq: Array | None, T_reference: Array, weight: Array) -> Array:
        hessian = self.objective.hessian(Node(self.robot, q, dq, ddq, T_reference), weight)
        return array(f"{self.where}: hessian", hessian, (3 * len(q), 3 * len(q)), what="by [q; dq; ddq]")


def bound(objectives: Iterable[Objective], robot: Robot) -> list[Any]:
    """For the library."""
    result = []
    if not isinstance(objectives, Iterable) or isinstance(objectives, (str, bytes)):
        raise TypeError(f"objectives must be a list of instances of steadyhand.Objective, not {type(objectives).__name__}")
    for objective in objectives:
        if not isinstance(objective, Objective):
            raise TypeError(f"objectives must be instances of steadyhand.Objective, not {type(objective).__name__}")
        if objective.acts_on not in ("intervals", "states"):
            raise ValueError(f"objective {objective.name!r} acts on {objective.acts_on!r}; it must be 'intervals' or 'states'")
        if not isinstance(objective.weight_count, int) or not 0 <= objective.weight_count <= 8:
            raise ValueError(f"objective {objective.name!r} has a weight_count of {objective.weight_count!r}; it must be from 0 to 8")
        for attribute in ("name", "unit"):
            text(f"{attribute} of the objective {type(objective).__name__}", getattr(objective, attribute))
        states = objective.acts_on == "states"
        result.append(_native.Objective.make(objective.name, objective.unit, states, objective.weight_count, _Bound(objective, robot)))
    return result


document(globals())
