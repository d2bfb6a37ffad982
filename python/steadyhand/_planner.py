"""Planners and the plans that they make."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _native
from ._arrays import Array, array, flag, number
from ._cell import CellLike, as_cell
from ._documented import document
from ._glass import GlassLike, glass_of
from ._options import Weights, options, weights_of
from ._objective import Objective, bound
from ._robot import Robot, as_robot, opened


class Plan:
    """A joint trajectory that has been checked and ends at rest: accelerations are constant over intervals of dt, first those
    of the optimal control problem, then a stop. K intervals, n joints; rad where a joint turns, m where it slides.
    """

    def __init__(self, native: Any, robot: Robot, object_names: list[str]) -> None:
        self._native = native
        self._object_names = object_names
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
        """What holds the arm back over the horizon: "reach", "self_collision", "obstacle", "position", "velocity",
        "acceleration", or "none"."""
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
        """The joint that is at its limit, the two bodies that are nearest, or the body and the object: who `active` is about."""
        kind, indices = self.active, [i for i in self._native.active_between if i >= 0]
        if kind == "self_collision":
            return tuple(self._solid(i) for i in indices)
        if kind == "obstacle":
            return self._solid(indices[0]), self._object_names[indices[1]]
        return tuple(self._robot.joint_names[i] for i in indices)

    def _solid(self, index: int) -> str:
        """A body of the arm, or behind those an object that the tool carries."""
        carried = index - _native.FIRST_CARRIED
        return self._object_names[carried] if carried >= 0 else self._robot.description["bodies"][index]["name"]

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


class _Stages:
    """What Planner and Pipeline share."""

    robot: Robot
    _stages: Any

    @property
    def horizon(self) -> int:
        """N, intervals of the optimal control problem."""
        return self._stages.horizon

    @property
    def dt(self) -> float:
        """s, length of an interval."""
        return self._stages.dt

    @property
    def weights(self) -> dict[str, Array]:
        """What is in force: by name of the term, a vector as long as the term has weights. `velocity` is at least 0.02."""
        return self._stages.weights

    def _plan(self, native: Any) -> Plan:
        return Plan(native, self.robot, self._stages.object_names)

    def set_weights(self, weights: Weights) -> None:
        """For the next plans: by name of the term a number, or as many as the term has. Terms that are not named stay.

        Raises SteadyhandError for a term that there is not, listing those that there are, another count, or a negative weight.
        """
        self._stages.set_weights(weights_of(weights))

    def set_cell(self, cell: CellLike, t: float) -> None:
        """What stands around the arm from the next plan on, in place of what did.

        cell: a Cell, or what Cell() takes; [] for nothing. t: s, on the clock of the plans: when what moves is where it says.
        Raises SteadyhandError for a cell that does not fit the robot, and where none was given at first: [] says that there will
        be one.
        """
        self._stages.set_cell(as_cell(cell)._native, number("t", t, "seconds"))

    def reset(self, q: ArrayLike | None = None, t: float = 0.0) -> None:
        """The arm stands at q from time t on, and what was planned is forgotten.

        q: (n,) rad (m), inside the arm's limits; home, if it is not given. t: s; may be before the last plan's.
        """
        n = self.robot.dof
        q = self.robot.home if q is None else array("q", q, (n,), what=f"one number for each joint of {self.robot.name}")
        self._stages.reset(q, number("t", t, "seconds"))


def _make(
    robot: Robot, profile: str | os.PathLike[str], given: dict[str, Any], objectives: Iterable[Objective], cell: CellLike | None
) -> Any:  # fmt: skip
    given["objectives"] = bound(objectives, robot)
    if cell is not None:
        given["cell"] = as_cell(cell)._native
    return opened("profile", profile, lambda name: _native.Stages.make(robot._native, name, given))


class Planner(_Stages):
    """Plans where the arm goes, again and again, so that its tool follows a target: inside its limits, clear of itself, and
    as its profile says of the liquid. The arm is taken to follow its plans, and to stand at home before the first.

    robot: a Robot, or what Robot() takes. profile: "tracking", "anti-slosh", "waiter", "carry", "follow", or the
    path of a profile file (docs/reference/profiles.md). What else is given stands in place of the profile's:

    weights: by name of the term (docs/explanation/formulation.md) a number, or as many as the term has.
    horizon: N, intervals, 1 to 128. dt: s, length of each.
    solver: its name (steadyhand.solvers). tolerance: of the KKT conditions. time_budget_us: us for a solve; 0: as long as it takes.
    velocity_scale, acceleration_scale: above 0, to 1: share of the robot's limits.
    window: s of targets from which their velocity is estimated.
    objectives: terms of the caller's own, steadyhand.Objective; at most 16 with those that there are.
    cell: what stands around the arm, a Cell or what Cell() takes: "table", or a list of Object. None: nothing, for good; []: nothing yet.

    Raises SteadyhandError (a ValueError) for unknown robots, profiles, terms and solvers, listing those that there are, for
    numbers out of range, and for files that are refused, with the reason; FileNotFoundError for a path where nothing is.

    >>> planner = Planner("ur5e", profile="waiter")
    >>> plan = planner.update(planner.robot.fk(planner.robot.home), t=0.0)
    >>> plan.status
    'solved'
    """

    def __init__(
        self,
        robot: Robot | str | os.PathLike[str],
        profile: str | os.PathLike[str] = "tracking",
        *,
        weights: Weights | None = None,
        horizon: int | None = None,
        dt: float | None = None,
        solver: str | None = None,
        tolerance: float | None = None,
        time_budget_us: float | None = None,
        velocity_scale: float | None = None,
        acceleration_scale: float | None = None,
        window: float | None = None,
        objectives: Iterable[Objective] = (),
        cell: CellLike | None = None,
    ) -> None:
        self.robot = as_robot(robot)
        given = options(
            weights=weights, horizon=horizon, dt=dt, solver=solver, tolerance=tolerance, time_budget_us=time_budget_us,
            velocity_scale=velocity_scale, acceleration_scale=acceleration_scale, window=window,
        )  # fmt: skip
        self._stages = _make(self.robot, profile, given, objectives, cell)

    def update(self, T_base_tool: ArrayLike, t: float, engaged: bool = True) -> Plan:
        """The plan from time t on.

        T_base_tool: (4, 4), where the tool shall be at time t, in the base; rotation, position in m. The planner follows what
        this target does: it goes on at the speed that the last targets had (docs/explanation/formulation.md), inside the arm's reach.
        t: s, on a clock of the caller's; must not go back.
        engaged: False forgets how the target moved: it rests.

        Raises ValueError for another shape, numbers that are not finite, a matrix that is no pose, or a time that goes back.
        Python's lock is released while it plans; two threads must not use one planner (SteadyhandError).
        """
        self.aim(T_base_tool, t, engaged)
        return self.plan(t)

    def aim(self, T_base_tool: ArrayLike, t: float, engaged: bool = True) -> None:
        """A target, as in update(), without a plan: for targets that come more often than plans are made."""
        self._stages.aim(array("T_base_tool", T_base_tool, (4, 4)), number("t", t, "seconds"), flag("engaged", engaged))

    def plan(self, t: float) -> Plan:
        """The plan from time t on, after targets by aim(). t: s; must not go back. Before any target the arm stays."""
        return self._plan(self._stages.plan(number("t", t, "seconds")))

    def follow(self, T_base_tool: ArrayLike, t: float) -> Plan:
        """The plan from time t on, towards poses of the caller's own prediction instead of a target.

        T_base_tool: (N, 4, 4), where the tool shall be at t + dt, ..., t + N dt, in the base; N = horizon. t: s; must not go back.
        Raises as update().
        """
        reference = array("T_base_tool", T_base_tool, (self.horizon, 4, 4), what="a pose for each node of the horizon")
        return self._plan(self._stages.follow(reference, number("t", t, "seconds")))


class Pipeline(_Stages):
    """From the operator's hand to joint commands, as the program does it: retargeting, prediction, planning and tracking. The
    arm is taken to follow its commands, and to stand at home at first.

    rate: Hz, plans that update() makes, 0.001 to 1e4. scale, yaw, translation_frame, rotation_frame, ramp: as Retargeter's; tilt, too,
    which is the profile's if it is not given. glass: a Glass, or its numbers, for a profile that knows a liquid. The rest: as Planner's.
    Raises as Planner.

    >>> arm = Pipeline("ur5e", profile="waiter")
    >>> arm.feed(np.eye(4), t=0.0, clutch=True)     # each pose of the hand
    >>> q, dq, ddq = arm.update(t=0.002)            # as often as the arm takes commands
    """

    def __init__(
        self,
        robot: Robot | str | os.PathLike[str],
        profile: str | os.PathLike[str] = "tracking",
        *,
        rate: float | None = None,
        scale: float | None = None,
        yaw: float | None = None,
        translation_frame: str | None = None,
        rotation_frame: str | None = None,
        ramp: float | None = None,
        tilt: float | None = None,
        glass: GlassLike | None = None,
        weights: Weights | None = None,
        horizon: int | None = None,
        dt: float | None = None,
        solver: str | None = None,
        tolerance: float | None = None,
        time_budget_us: float | None = None,
        velocity_scale: float | None = None,
        acceleration_scale: float | None = None,
        window: float | None = None,
        objectives: Iterable[Objective] = (),
        cell: CellLike | None = None,
    ) -> None:
        self.robot = as_robot(robot)
        given = options(
            rate=rate, scale=scale, yaw=yaw, translation_frame=translation_frame, rotation_frame=rotation_frame, ramp=ramp,
            tilt=tilt, glass=glass_of(glass), weights=weights, horizon=horizon, dt=dt, solver=solver, tolerance=tolerance, time_budget_us=time_budget_us,
            velocity_scale=velocity_scale, acceleration_scale=acceleration_scale, window=window,
        )  # fmt: skip
        self._stages = _make(self.robot, profile, given, objectives, cell)

    def feed(self, T_operator_hand: ArrayLike, t: float, clutch: bool = True) -> None:
        """The hand at time t. The arm engages with the clutch, and lets go with it.

        T_operator_hand: (4, 4), robot axes (x forward, y left, z up), m. t: s, on the clock of update().
        Raises ValueError for another shape, numbers that are not finite, or a matrix that is no pose; then nothing changes.
        """
        self._stages.feed(array("T_operator_hand", T_operator_hand, (4, 4)), number("t", t, "seconds"), flag("clutch", clutch))

    def update(self, t: float) -> tuple[Array, Array, Array]:
        """q, dq, ddq of the arm at time t: (n,) each, rad, rad/s, rad/s^2 (m, ...). Makes a new plan first where the last is older
        than a period of the rate. Times that go back repeat the last command.
        """
        return self._stages.update(number("t", t, "seconds"))

    @property
    def plan(self) -> Plan:
        """The one that is followed."""
        return self._plan(self._stages.last_plan())

    @property
    def target(self) -> Array:
        """T_base_tool (4, 4): where the newest hand wants the tool."""
        return self._stages.target[0]

    @property
    def engaged(self) -> bool:
        """Whether the arm follows the hand."""
        return self._stages.target[1]

    def set_tilt(self, tilt: float) -> None:
        """rad, how far the glass may lean with the hand: 0 is upright, pi as the hand leans. It does not jump there."""
        self._stages.set_tilt(number("tilt", tilt))

    def set_no_spill(self, on: bool) -> None:
        """Whether the next plans shall spill nothing. Raises SteadyhandError where the profile knows no liquid."""
        self._stages.set_no_spill(flag("on", on))

    def release(self) -> None:
        """Lets go of the hand: the next pose with a closed clutch takes hold anew."""
        self._stages.release()


document(globals())
