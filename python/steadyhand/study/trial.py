"""One trial in virtual time: an operator, the machine with its latency, the liquid, and the task, in a closed loop."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from .._arrays import Array
from .._planner import Pipeline
from .._robot import Robot
from .._stages import Liquid
from .one_instant_ik import OneInstantIk
from .operator import STEP, Operator, Person, View
from .tasks import Course, Reached, Task

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
    """A trial as rows in time, every STEP. Arrays have a row for each."""

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
    track: Track
    reached: list[Reached]
    spilled_share: float
    submovements: int


class Assisted:
    """The planner in the loop, as the program has it."""

    def __init__(self, robot: Robot, condition: Condition, rate: float) -> None:
        self._pipeline = Pipeline(robot, condition.profile, rate=rate, scale=condition.scale, yaw=0.0)  # the hand moves in base axes
        stages = self._pipeline._stages  # skips the checks of input, which is valid here
        self.feed, self.update = stages.feed, stages.update

    @property
    def target(self) -> Array:
        return self._pipeline.target

    @property
    def held_back(self) -> str:
        return self._pipeline._stages.last_plan().active


def run_trial(
    robot: Robot, condition: Condition, task: Task, person: Person, rng: np.random.Generator, rate: float = 50.0
) -> Trial:  # fmt: skip
    """A simulated operator does the task. rate: Hz, of plans. The same rng gives the same trial."""
    machine = OneInstantIk(robot, condition.scale) if condition.profile == ONE_INSTANT_IK else Assisted(robot, condition, rate)
    operator = Operator(person, condition.scale, condition.command_latency + condition.display_latency, rng)
    liquid = Liquid()
    start = robot.fk(robot.home)
    course = Course(task, start[:3, 3])
    track = Track()
    hands: deque[tuple[float, Array]] = deque()
    shown: deque[tuple[float, View]] = deque()
    glass = target = start[:3, 3].copy()
    view = View(glass, target, None)
    step_liquid, native = liquid._native.update, robot._native  # skips the checks of input, which is valid here
    T_hand = np.eye(4)
    machine.feed(T_hand, 0.0, True)  # no latency delays the engagement: the ghost is there from the start
    cycles = round(STEP / CONTROL)
    k = 0
    while not course.over:
        t = k * STEP
        # The display shows a state that is display_latency old.
        course.take(t, glass)
        shown.append((t + condition.display_latency, View(glass, target, course.goal, course.following)))
        while shown and shown[0][0] <= t + 1e-9:
            view = shown.popleft()[1]
        hand = operator.step(view)
        # The command: behind the gate, so each sample counts as new when it comes out.
        hands.append((t + condition.command_latency, hand))
        while hands and hands[0][0] <= t + 1e-9:
            due, p = hands.popleft()
            T_hand[:3, 3] = p
            machine.feed(T_hand, due, True)
        for i in range(cycles):
            q, dq, ddq = machine.update(t + i * CONTROL)
            state = step_liquid(CONTROL, native.local_acceleration(q, dq, ddq))
        glass = native.fk(q)[:3, 3].copy()
        target = machine.target[:3, 3].copy()
        goal = course.goal
        track.t.append(t)
        track.hand.append(hand)
        track.target.append(target)
        track.glass.append(glass)
        track.q.append(q)
        track.dq.append(dq)
        track.goal.append(-1 if goal is None else goal.index)
        track.held_back.append(machine.held_back)
        track.freeboard.append(state[2])
        track.spilled_share.append(state[4])
        k += 1
    return Trial(track, course.reached, liquid_share(track), operator.submovements)


def liquid_share(track: Track) -> float:
    return track.spilled_share[-1] if track.spilled_share else 0.0
