"""Planners and their plans."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _native
from ._arrays import Array, array, flag, flags, number
from ._cell import CellLike, as_cell
from ._documented import document
from ._glass import GlassLike, glass_of
from ._options import Weights, options, weights_of
from ._objective import Objective, bound
from ._robot import Robot, as_robot, opened


class Plan:
    """A checked joint trajectory that ends at rest: K intervals of dt with constant acceleration, for n joints. The first N
    intervals solve the optimal control problem, the others stop the arm. Units: rad for revolute, m for prismatic joints.
    """

    def __init__(self, native: Any, robot: Robot, object_names: list[str]) -> None:
        self._native = native
        self._object_names = object_names
        self.q: Array = native.q
        """(K + 1, n), rad (m): positions at start + k dt."""
        self.dq: Array = native.dq
        """(K + 1, n), rad/s (m/s): velocities at the same times; the last row is 0 except for rounding."""
        self.ddq: Array = native.ddq
        """(K, n), rad/s^2 (m/s^2): accelerations from start + k dt to start + (k + 1) dt."""
        self.dt: float = native.dt
        """s, length of an interval."""
        self.start: float = native.start
        """s, time of the first row, on your clock."""
        self.status: str = native.status
        """"solved": the optimum. "feasible": all constraints hold, but the solver stopped before the optimum. "previous": the
        solution failed its check (see fault); this is the last good plan, which the arm follows to its end."""
        self.fault: str = native.fault
        """Which check the solution failed, or "none"."""
        self.active: str = native.active
        """The active limit over the horizon: "reach", "self_collision", "obstacle", "position", "velocity", "acceleration" or
        "none"."""
        self.solve_us: float = native.solve_us
        """us, wall time of the solver."""
        self.iterations: int = native.iterations
        """Iterations of the solver."""
        self.objective: float = native.objective
        """Cost J of the solution."""
        self.nodes: int = native.nodes
        """N, the number of intervals of the optimal control problem; the intervals after them stop the arm."""
        self._robot = robot

    @property
    def active_names(self) -> tuple[str, ...]:
        """The names that `active` refers to: the joint at its limit, the two nearest bodies, or the body and the object."""
        kind, indices = self.active, [i for i in self._native.active_between if i >= 0]
        if kind == "self_collision":
            return tuple(self._solid(i) for i in indices)
        if kind == "obstacle":
            return self._solid(indices[0]), self._object_names[indices[1]]
        return tuple(self._robot.joint_names[i] for i in indices)

    def _solid(self, index: int) -> str:
        """Name of a body of the arm, or, with a larger index, of a carried object."""
        carried = index - _native.FIRST_CARRIED
        return self._object_names[carried] if carried >= 0 else self._robot.description["bodies"][index]["name"]

    @property
    def end(self) -> float:
        """s, time from which the arm is stationary."""
        return self.start + len(self.ddq) * self.dt

    def at(self, t: ArrayLike) -> tuple[Array, Array, Array]:
        """State at time t, exact between nodes. Before the start it is the first row; after the end it is at rest.

        t: s on your clock, a number or (m,). Returns q, dq, ddq, each (n,) or (m, n): rad, rad/s, rad/s^2 (m, ...).
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
    """Members that Planner and Pipeline share."""

    robot: Robot
    _stages: Any

    @property
    def horizon(self) -> int:
        """N, number of intervals of the optimal control problem."""
        return self._stages.horizon

    @property
    def dt(self) -> float:
        """s, length of an interval."""
        return self._stages.dt

    def _of_tools(self, name: str, value: ArrayLike, *rows: int) -> Array:
        """Poses of all tools, one after another; a robot with one needs no axis for it."""
        tools = self.robot.tool_count
        shape = (*rows, 4, 4) if tools == 1 else (tools, *rows, 4, 4)
        what = ("a pose for each node of the horizon" if rows else "") + (f"{' of ' if rows else 'a pose for '}each tool: {', '.join(self.robot.tool_names)}" if tools > 1 else "")
        return array(name, value, shape, what=what).reshape(-1, 4, 4)

    @property
    def weights(self) -> dict[str, Array]:
        """Current weights: for each term, by name, one entry per weight. `velocity` is at least 0.02."""
        return self._stages.weights

    def _plan(self, native: Any) -> Plan:
        return Plan(native, self.robot, self._stages.object_names)

    def set_weights(self, weights: Weights) -> None:
        """Sets weights for the next plans: by name of the term, one number or one for each of its weights. Other terms keep theirs.

        Raises SteadyhandError for an unknown term (the message lists the valid ones), a wrong count, or a negative weight.
        """
        self._stages.set_weights(weights_of(weights))

    def set_cell(self, cell: CellLike, t: float) -> None:
        """Replaces the obstacles, from the next plan on.

        cell: a Cell, or an argument of Cell(); [] for no obstacles. t: s, on the clock of the plans: the time at which moving
        obstacles are at their given poses. Raises SteadyhandError if the cell does not fit the robot, and if the planner was made
        without a cell; give cell=[] there to add obstacles later.
        """
        self._stages.set_cell(as_cell(cell)._native, number("t", t, "seconds"))

    def reset(self, q: ArrayLike | None = None, t: float = 0.0) -> None:
        """Discards the plans: from time t on the arm is stationary at q.

        q: (n,), rad (m), within the arm's limits; default: home. t: s; may be before the last plan.
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
    """Receding-horizon planner: each call makes a joint trajectory whose tool follows a target, or whose tools follow one each,
    within joint limits and without collisions. It assumes that the arm follows its plans exactly, and is at home before the first.

    robot: a Robot, or an argument of Robot(). profile: "tracking", "anti-slosh", "waiter", "carry", "follow", or the path of a
    profile file (docs/reference/profiles.md). The following arguments replace values of the profile:

    weights: by name of the term (docs/explanation/formulation.md), one number or one for each of its weights.
    horizon: N, number of intervals, 1 to 128. dt: s, length of an interval.
    solver: one of steadyhand.solvers. tolerance: of the KKT conditions. time_budget_us: us for each solve; 0: no limit.
    velocity_scale, acceleration_scale: factors on the robot's limits, above 0, at most 1.
    window: s, time span of the targets from which their velocity is estimated.
    objectives: your own terms (steadyhand.Objective); at most 16 together with the built-in ones.
    cell: the obstacles: a Cell, or an argument of Cell() such as "table" or a list of Object. None: no obstacles, now and later;
    []: none yet.

    Raises SteadyhandError (a ValueError) for unknown robots, profiles, terms and solvers (the message lists the valid ones), for
    numbers out of range, and for invalid files; FileNotFoundError for a path that does not exist.

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

    def update(self, T_base_tool: ArrayLike, t: float, engaged: ArrayLike = True) -> Plan:
        """Makes the plan from time t on.

        T_base_tool: (4, 4), the target of the tool at time t, in the base frame; position in m. Robots with two tools: (2, 4, 4), or
        a list of two. The planner predicts that the target continues at the velocity of the last targets
        (docs/explanation/formulation.md), within the arm's reach.
        t: s, on your clock; must not go back.
        engaged: False: the target is at rest, and its earlier motion is discarded. One for all tools, or one for each.

        Raises ValueError for a wrong shape, numbers that are not finite, a matrix that is not a pose, or a time that goes back.
        Python's lock is released during planning. Two threads must not use one planner at a time (SteadyhandError).
        """
        self.aim(T_base_tool, t, engaged)
        return self.plan(t)

    def aim(self, T_base_tool: ArrayLike, t: float, engaged: ArrayLike = True) -> None:
        """Adds a target without making a plan, for targets that come more often than plans. Arguments as update()."""
        tools = self.robot.tool_count
        follow = [flag("engaged", engaged)] * tools if np.ndim(engaged) == 0 else flags("engaged", engaged, tools, "one for each tool").tolist()
        self._stages.aim(self._of_tools("T_base_tool", T_base_tool), number("t", t, "seconds"), follow)

    def plan(self, t: float) -> Plan:
        """Makes the plan from time t on, after targets from aim(). t: s; must not go back. Without targets the arm stays at rest."""
        return self._plan(self._stages.plan(number("t", t, "seconds")))

    def follow(self, T_base_tool: ArrayLike, t: float) -> Plan:
        """Makes the plan from time t on, with your own prediction instead of a target.

        T_base_tool: (N, 4, 4), target poses at t + dt, ..., t + N dt in the base frame, position in m; N = horizon. Robots with two
        tools: (2, N, 4, 4). t: s; must not go back. Raises as update().
        """
        reference = self._of_tools("T_base_tool", T_base_tool, self.horizon)
        return self._plan(self._stages.follow(reference, number("t", t, "seconds")))


class Pipeline(_Stages):
    """All stages, from the operator's hand to joint commands: retargeting, prediction, planning and tracking. It assumes that the
    arm follows its commands exactly, and is at home at first.

    rate: Hz, plans per second, 0.001 to 1e4. scale, yaw, translation_frame, rotation_frame, ramp, tilt: as Retargeter; the default
    tilt is the profile's. glass: a Glass, or its numbers, for a profile with a liquid. Other arguments and errors: as Planner.

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

    def feed(self, T_operator_hand: ArrayLike, t: float, clutch: bool = True, tool: int = 0) -> None:
        """Adds the hand's pose at time t. The tool that it moves is engaged while the clutch is closed.

        T_operator_hand: (4, 4), in the operator frame with robot axes (x forward, y left, z up), m. t: s, on the clock of update().
        tool: index of the tool that this hand moves; each tool has its own hand. A tool that never had one stays where it is.
        Raises ValueError for a wrong shape, numbers that are not finite, or a matrix that is not a pose; then nothing changes.
        """
        self._stages.feed(array("T_operator_hand", T_operator_hand, (4, 4)), number("t", t, "seconds"), flag("clutch", clutch), self.robot._tool(tool))

    def update(self, t: float) -> tuple[Array, Array, Array]:
        """Joint command at time t: q, dq, ddq, (n,) each, rad, rad/s, rad/s^2 (m, ...). If the last plan is older than a period of
        the rate, a new plan is made first. A time that goes back repeats the last command.
        """
        return self._stages.update(number("t", t, "seconds"))

    @property
    def plan(self) -> Plan:
        """The plan that the arm follows."""
        return self._plan(self._stages.last_plan())

    @property
    def target(self) -> Array:
        """Target T_base_tool (4, 4) of the newest pose of the hand; m. Robots with two tools: (2, 4, 4)."""
        targets = [self._stages.target(tool)[0] for tool in range(self.robot.tool_count)]
        return targets[0] if len(targets) == 1 else np.array(targets)

    @property
    def engaged(self) -> bool | tuple[bool, ...]:
        """Whether the arm follows the hand. Robots with two tools: one for each."""
        engaged = tuple(bool(self._stages.target(tool)[1]) for tool in range(self.robot.tool_count))
        return engaged[0] if len(engaged) == 1 else engaged

    def set_tilt(self, tilt: float) -> None:
        """Sets how far the glass may lean with the hand, rad: 0 is upright, pi is as the hand leans. The target turns there at 1 rad/s."""
        self._stages.set_tilt(number("tilt", tilt))

    def set_no_spill(self, on: bool) -> None:
        """Turns the liquid's constraints on or off for the next plans. Raises SteadyhandError if the profile has no liquid."""
        self._stages.set_no_spill(flag("on", on))

    def release(self) -> None:
        """Releases the clutch: the next pose with a closed clutch engages again."""
        self._stages.release()


document(globals())
