"""Objectives of the optimal control problem, written in Python."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from . import _native
from ._arrays import Array, array, number, text
from ._documented import document
from ._robot import Robot, as_robot


class Node:
    """State of one node of the horizon, for terms."""

    __slots__ = ("robot", "q", "dq", "ddq", "T_reference", "_T")

    def __init__(self, robot: Robot, q: Array, dq: Array, ddq: Array | None, T_reference: Array) -> None:
        self.robot = robot
        self.q = q
        """(n,), rad (m)."""
        self.dq = dq
        """(n,), rad/s (m/s)."""
        self.ddq = ddq
        """(n,), rad/s^2 (m/s^2); None for terms that act on states."""
        self.T_reference = T_reference
        """(4, 4), reference pose of the tool in the base frame, m."""
        self._T: Array | None = None

    @property
    def T_base_tool(self) -> Array:
        """(4, 4), pose of the tool in the base frame, m."""
        if self._T is None:
            self._T = self.robot._native.fk(self.q)
        return self._T

    @property
    def jacobian(self) -> Array:
        """(6, n), as Robot.jacobian()."""
        return self.robot._native.jacobian(self.q)

    @property
    def local_acceleration(self) -> Array:
        """(3,), m/s^2, specific force as Robot.local_acceleration(); only for terms that act on intervals."""
        return self.robot._native.local_acceleration(self.q, self.dq, self.ddq)

    @property
    def z(self) -> Array:
        """(3n,): [q; dq; ddq], the variables of derivatives; ddq is 0 for terms that act on states."""
        return np.concatenate([self.q, self.dq, np.zeros_like(self.q) if self.ddq is None else self.ddq])

    def moved_to(self, z: Array) -> Node:
        """Returns the node with other q, dq, ddq, from z (3n,)."""
        q, dq, ddq = np.split(z, 3)
        return Node(self.robot, q, dq, None if self.ddq is None else ddq, self.T_reference)


class Objective:
    """Base class of a custom objective: inherit, and implement value(). The planner minimises the sum over the horizon of dt times all
    terms. A term is linear in its weights. Planner(weights={name: ...}) sets them; the default is 0.

    name: lower-case letters, digits and underscores. weight_count: number of weights; 0: one for each joint.
    acts_on: "intervals" (nodes k = 0..N-1, with ddq) or "states" (nodes k = 1..N, without). unit: of a weight, for people.

    Without gradient() and hessian(), finite differences replace them; that is slower and less exact. check_derivatives() compares
    yours with differences. With wrong derivatives plans fail, or are not optimal. Python is called for each node in each iteration.
    Use such a planner to try terms, not in a real-time loop (docs/explanation/results.md has times).

    An exception in your objective ends the planner's call. The planner then continues from its last good plan.

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
        """Value of the term at a node. weight: (weight_count,)."""
        raise NotImplementedError(f"{type(self).__name__} has no value(node, weight)")

    def gradient(self, node: Node, weight: Array) -> Array:
        """Derivative of value() by z = [q; dq; ddq], (3n,)."""
        return _differences(lambda z: _value(self, node.moved_to(z), weight), node.z, 1e-6, self._free(node))

    def hessian(self, node: Node, weight: Array) -> Array:
        """Second derivative of value() by z, (3n, 3n), symmetric."""
        free = self._free(node)
        if type(self).gradient is not Objective.gradient:
            H = _differences(lambda z: _gradient(self, node.moved_to(z), weight), node.z, 1e-6, free)
            return (H + H.T) / 2
        return _second_differences(lambda z: _value(self, node.moved_to(z), weight), node.z, 1e-4, free)

    def check_derivatives(self, robot: Robot | str | os.PathLike[str], weight: ArrayLike | None = None, *, hessian: bool = True, nodes: int = 10, seed: int = 1) -> None:
        """Compares gradient() and hessian() with finite differences at random nodes within the robot's limits.

        weight: (weight_count,); default: ones. hessian: False skips an intentionally approximate Hessian. nodes: number of nodes.
        seed: of the nodes. Raises ValueError with the entry, the joint, both numbers and the node's q.
        """
        model = as_robot(robot)
        bound([self], model)  # refuses bad names, units and the like
        n = model.dof
        count = self.weight_count or n
        w = np.ones(count) if weight is None else array("weight", weight, (count,), what="the term's weights")
        rng = np.random.default_rng(seed)
        low, high = np.maximum(model.position_min, -np.pi), np.minimum(model.position_max, np.pi)
        for _ in range(nodes):
            q, aim = rng.uniform(low, high), rng.uniform(low, high)
            dq, ddq = (rng.uniform(-0.5, 0.5, n) * limit for limit in (model.velocity_max, model.acceleration_max))
            node = Node(model, q, dq, None if self.acts_on == "states" else ddq, model.fk(aim))
            size = abs(_value(self, node, w))
            if type(self).gradient is not Objective.gradient:
                _compare(f"objective {self.name!r}: gradient", _gradient(self, node, w), Objective.gradient(self, node, w), 1e-4, 1e-6 * size, node)
            if hessian and type(self).hessian is not Objective.hessian:
                _compare(f"objective {self.name!r}: hessian", _hessian(self, node, w), Objective.hessian(self, node, w), 1e-3, 1e-5 * size, node)

    @staticmethod
    def _free(node: Node) -> int:
        """Number of entries of z that the term may depend on."""
        return len(node.q) * (2 if node.ddq is None else 3)


def _value(objective: Objective, node: Node, weight: Array) -> float:
    return number(f"objective {objective.name!r}: value", objective.value(node, weight))


def _gradient(objective: Objective, node: Node, weight: Array) -> Array:
    return array(f"objective {objective.name!r}: gradient", objective.gradient(node, weight), (3 * len(node.q),), what="by [q; dq; ddq]")


def _hessian(objective: Objective, node: Node, weight: Array) -> Array:
    n = 3 * len(node.q)
    return array(f"objective {objective.name!r}: hessian", objective.hessian(node, weight), (n, n), what="by [q; dq; ddq]")


def _compare(name: str, given: Array, expected: Array, share: float, noise: float, node: Node) -> None:
    """share: accepted error relative to the largest entry. noise: accepted absolute error, which grows with the values."""
    off = np.abs(given - expected)
    if off.max() <= share * np.abs(expected).max() + noise + 1e-7:
        return
    worst = tuple(int(i) for i in np.unravel_index(off.argmax(), off.shape))
    n = len(node.q)
    by = ", ".join(f"{('q', 'dq', 'ddq')[i // n]} of {node.robot.joint_names[i % n]}" for i in worst)
    raise ValueError(f"{name}[{', '.join(map(str, worst))}] (by {by}) is {given[worst]:.6g}; differences say {expected[worst]:.6g}, at q = {node.q.round(3).tolist()}")


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
    """A term of one robot, as the library calls it. It checks the term's results."""

    def __init__(self, objective: Objective, robot: Robot) -> None:
        self.objective, self.robot = objective, robot

    def value(self, q: Array, dq: Array, ddq: Array | None, T_reference: Array, weight: Array) -> float:
        return _value(self.objective, Node(self.robot, q, dq, ddq, T_reference), weight)

    def gradient(self, q: Array, dq: Array, ddq: Array | None, T_reference: Array, weight: Array) -> Array:
        return _gradient(self.objective, Node(self.robot, q, dq, ddq, T_reference), weight)

    def hessian(self, q: Array, dq: Array, ddq: Array | None, T_reference: Array, weight: Array) -> Array:
        return _hessian(self.objective, Node(self.robot, q, dq, ddq, T_reference), weight)


def bound(objectives: Iterable[Objective], robot: Robot) -> list[Any]:
    """The objectives in the form of the library. Raises TypeError or ValueError for an invalid objective."""
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
