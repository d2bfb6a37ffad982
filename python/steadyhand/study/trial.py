"""One trial in virtual time: an operator, the machine with its latency, the liquid, and the task, in a closed loop."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from .._arrays import Array
from .._planner import Pipeline
from .._robot import Robot
from .._stages import Liquid
from .one_instant_ik import OneInstantIk
from .operator import STEP, Hands, Person, View
from .tasks import Courses, Reached, Task

CONTROL = 0.005  # s, between two samples of the command; the liquid takes smaller steps itself
ONE_INSTANT_IK = "one-instant-ik"  # in the place of a profile's name
PATHS = ("command", "display", "both")


@dataclass(frozen=True)
class Condition:
    """A condition of the comparison. name: for people. profile: a profile's name or file, or ONE_INSTANT_IK.

    latency: s, added on purpose; path: which way it delays: "command", from the hand's gate to the retargeting, "display", from the
    arm to the picture, or "both", each by all of it.
    """

    name: str
    profile: str = "tracking"
    scale: float = 0.5
    latency: float = 0.0
    path: str = "command"
    factors: tuple[tuple[str, str], ...] = ()
    """Factors and this condition's levels, in a factorial study."""

    @property
    def command_latency(self) -> float:
        return self.latency if self.path in ("command", "both") else 0.0

    @property
    def display_latency(self) -> float:
        return self.latency if self.path in ("display", "both") else 0.0


@dataclass
class Track:
    """A trial of one tool as rows in time, every STEP. Arrays have a row for each."""

    t: list[float] = field(default_factory=list)
    """s."""
    hand: list[Array] = field(default_factory=list)
    """(3,), m, from where it gripped, operator's frame."""
    target: list[Array] = field(default_factory=list)
    """(3,), m, base: where the hand wants the glass."""
    glass: list[Array] = field(default_factory=list)
    """(3,), m, base: where it is."""
    q: list[Array] = field(default_factory=list)
    """(n,), rad."""
    dq: list[Array] = field(default_factory=list)
    goal: list[int] = field(default_factory=list)
    """Index of the goal shown."""
    held_back: list[str] = field(default_factory=list)
    """What held the arm back: a limit, a distance, or "none"."""
    freeboard: list[float] = field(default_factory=list)
    """m."""
    spilled_share: list[float] = field(default_factory=list)


@dataclass(frozen=True)
class Trial:
    """A trial of the first tool of its task. others: of further tools, at the same time."""

    track: Track
    reached: list[Reached]
    spilled_share: float
    submovements: int
    others: tuple[Trial, ...] = ()

    @staticmethod
    def of(tracks: Sequence[Track], courses: Courses, submovements: Sequence[int]) -> Trial:
        each = [Trial(track, course.reached, liquid_share(track), n) for track, course, n in zip(tracks, courses.each, submovements)]
        return replace(each[0], others=tuple(each[1:]))


class Assisted:
    """The planner in the loop, as the program has it."""

    def __init__(self, robot: Robot, condition: Condition, rate: float) -> None:
        self._pipeline = Pipeline(robot, condition.profile, rate=rate, scale=condition.scale, yaw=0.0)  # the hand moves in base axes
        stages = self._pipeline._stages  # skips the checks of input, which is valid here
        self.feed, self.update = stages.feed, stages.update

    @property
    def targets(self) -> Array:
        return self._pipeline.target.reshape(-1, 4, 4)

    @property
    def held_back(self) -> str:
        return self._pipeline._stages.last_plan().active


def run_trial(
    robot: Robot, condition: Condition, task: Task, person: Person, rng: np.random.Generator, rate: float = 50.0
) -> Trial:  # fmt: skip
    """A simulated operator does the task, with a hand for each of its tools. rate: Hz, of plans. The same rng gives the same trial."""
    machine = OneInstantIk(robot, condition.scale) if condition.profile == ONE_INSTANT_IK else Assisted(robot, condition, rate)
    tools = task.tools
    operator = Hands(person, condition.scale, condition.command_latency + condition.display_latency, rng, len(tools))
    liquids = [Liquid()._native.update for _ in tools]  # skips the checks of input, which is valid here
    native = robot._native  # as well
    glasses = targets = [robot.fk(robot.home, tool)[:3, 3].copy() for tool in tools]
    courses = Courses(task, glasses)
    tracks = [Track() for _ in tools]
    sent: deque[tuple[float, list[Array]]] = deque()
    shown: deque[tuple[float, list[View]]] = deque()
    views = [View(glass, glass, None) for glass in glasses]
    T_hand = np.eye(4)
    for tool in tools:
        machine.feed(T_hand, 0.0, True, tool)  # no latency delays the engagement: the ghost is there from the start
    cycles = round(STEP / CONTROL)
    k = 0
    while not courses.over:
        t = k * STEP
        # The display shows a state that is display_latency old.
        courses.take(t, glasses)
        seen = [View(glass, target, course.goal, course.following) for glass, target, course in zip(glasses, targets, courses.each)]
        shown.append((t + condition.display_latency, seen))
        while shown and shown[0][0] <= t + 1e-9:
            views = shown.popleft()[1]
        hands = operator.step(views)
        # The command: behind the gate, so each sample counts as new when it comes out.
        sent.append((t + condition.command_latency, hands))
        while sent and sent[0][0] <= t + 1e-9:
            due, positions = sent.popleft()
            for tool, p in zip(tools, positions):
                T_hand[:3, 3] = p
                machine.feed(T_hand, due, True, tool)
        for i in range(cycles):
            q, dq, ddq = machine.update(t + i * CONTROL)
            liquid = [step(CONTROL, native.local_acceleration(q, dq, ddq, tool)) for step, tool in zip(liquids, tools)]
        glasses = [native.fk(q, tool)[:3, 3].copy() for tool in tools]
        targets = [machine.targets[tool, :3, 3].copy() for tool in tools]
        for i, (track, course) in enumerate(zip(tracks, courses.each)):
            track.t.append(t)
            track.hand.append(hands[i])
            track.target.append(targets[i])
            track.glass.append(glasses[i])
            track.q.append(q)
            track.dq.append(dq)
            track.goal.append(-1 if course.goal is None else course.goal.index)
            track.held_back.append(machine.held_back)
            track.freeboard.append(liquid[i][2])
            track.spilled_share.append(liquid[i][4])
        k += 1
    return Trial.of(tracks, courses, [hand.submovements for hand in operator.each])


def liquid_share(track: Track) -> float:
    return track.spilled_share[-1] if track.spilled_share else 0.0
