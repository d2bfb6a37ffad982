"""Planners and the plans that they make."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _native
from ._arrays import Array, array, number
from .robot import Robot, as_robot, opened


class Plan:
    """A joint trajectory that has been checked and ends at rest: accelerations are constant over intervals of dt, first those
    of the optimal control problem, then a stop. K intervals, n joints; rad where a joint turns, m where it slides.
    """

    def __init__(self, native: Any, robot: Robot) -> None:
        self._native = native
        self.q: Array = native.q
        """(K + 1, n), rad (m): positions at start + k dt."""
        self.dq: Array = native.dq
        """(K + 1, n), rad/s (m/s): velocities there; the last row is 0, but for rounding."""
        self.ddq: Array = native.ddq
        """(K, n), rad/s^2 (m/s^2): accelerations from start + k dt to start + (k + 1) dt."""
        self.dt: float = native.dt
        """s, length of an interval."""
        self.start: float = native.start
        """s, time of the first row, on the caller's clock."""
        self.status: str = native.status
        """"solved": the optimum; "feasible": inside every constraint, but the solver ended before the optimum; "previous": what
        was solved failed its check (see fault), and this is the last good plan, to be followed to its end."""
        self.fault: str = native.fault
        """Which check the solution failed, or "none"."""
        self.active: str = native.active
        """What holds the arm back over the horizon: "reach", "self_collision", "position", "velocity", "acceleration", or
        "none"."""
        self.solve_us: float = native.solve_us
        """us of wall time that the solver took."""
        self.iterations: int = native.iterations
        """Of the solver."""
        self.objective: float = native.objective
        """J of the solution."""
        self.nodes: int = native.nodes
        """N: the first N intervals are the optimal control problem's, those behind them the stop's."""
        self._robot = robot

    @property
    def active_names(self) -> tuple[str, ...]:
        """The joint that is at its limit, or the two spheres that are nearest: who `active` is about."""
        kind, indices = self.active, [i for i in self._native.active_between if i >= 0]
        if kind == "self_collision":
            return tuple(self._robot.description["spheres"][i]["name"] for i in indices)
        return tuple(self._robot.joint_names[i] for i in indices)

    @property
    def end(self) -> float:
        """s: from here on the arm stands."""
        return self.start + len(self.ddq) * self.dt

    def at(self, t: ArrayLike) -> tuple[Array, Array, Array]:
        """q, dq, ddq at time t: exact between nodes, the first row before the start, at rest after the end.

        t: s on the caller's clock, a number or (m,). Returns three arrays (n,), or (m, n): rad, rad/s, rad/s^2 (m, ...).
        """
        if np.ndim(t) == 0:
            return self._native.at(number("t", t, "seconds"))
        times = array("t", t, ("m",), what="times in s")
        q, dq, ddq = (np.empty((len(times), self.q.shape[1])) for _ in range(3))
        for i, time in enumerate(times):
            q[i], dq[i], ddq[i] = self._native.at(time)
        return q, dq, ddq

    def __repr__(self) -> str:
        return f"<steadyhand.Plan from {self.start:g} s to {self.end:g} s, {self.status}, active: {self.active}>"


class Planner:
    """Plans where the arm goes, again and again, so that its tool follows a target: inside its limits, clear of itself, and
    as its profile says of the liquid. The arm is taken to follow its plans.

    `robot`: a Robot, or what Robot() takes. `profile`: "tracking", "anti-slosh", "waiter", or the path of a profile file
    (docs/profiles.md).

    Raises SteadyhandError (a ValueError) for unknown names, listing those that there are, and for files that are refused, with
    the reason; FileNotFoundError for a path where nothing is.

    >>> planner = Planner("ur5e", profile="waiter")
    >>> plan = planner.update(planner.robot.fk(planner.robot.home), t=0.0)
    >>> plan.status
    'solved'
    """

    def __init__(self, robot: Robot | str | os.PathLike[str], profile: str | os.PathLike[str] = "tracking") -> None:
        self.robot = as_robot(robot)
        self._stages = opened("profile", profile, lambda name: _native.Stages.make(self.robot._native, name))

    def update(self, T_base_tool: ArrayLike, t: float, engaged: bool = True) -> Plan:
        """The plan from time t on.

        T_base_tool: (4, 4), where the tool shall be at time t, in the base; rotation, position in m. The planner follows what
        this target does: it goes on at the speed that the last targets had (docs/formulation.md), inside the arm's reach.
        t: s, on a clock of the caller's; must not go back.
        engaged: False forgets how the target moved: it rests.

        Raises ValueError for another shape, numbers that are not finite, a matrix that is no pose, or a time that goes back.
        Python's lock is released while it plans; two threads must not use one planner (SteadyhandError).
        """
        self._stages.aim(array("T_base_tool", T_base_tool, (4, 4)), number("t", t, "seconds"), bool(engaged))
        return Plan(self._stages.plan(t), self.robot)
