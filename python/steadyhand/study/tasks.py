"""Tasks of a participant: goals for the glass, in the base's frame, one after another.

Every task has `goals(start)`: the Goals of a trial, m in the base, where start (3,) is the home position of the glass, and `tools`: the
indices of the tools that do it, at the same time. Courses follows their glasses and selects the goals that are shown, the same for
people and simulated operators.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, pi, sin

import numpy as np

from .._arrays import Array
from .operator import Goal


@dataclass(frozen=True)
class Targets:
    """The multidirectional tapping task of ISO 9241-411: targets on a circle, reached across it in turn. A target counts as reached
    once the glass's centre has stayed in it for `dwell`; that time is not counted, and the first reach, from the middle, is not either.
    """

    name: str
    distance: float
    """m, the circle's diameter, nearly the amplitude of a reach."""
    width: float
    """m, a target's diameter."""
    count: int = 9
    """Of targets, odd."""
    dwell: float = 0.3
    """s."""
    plane: str = "yz"
    """In which the circle lies: the base's axes."""
    timeout: float = 10.0
    """s for a reach, then it is missed."""
    tools: tuple[int, ...] = (0,)
    """Two: a circle for each, at its home, with the same order. The next targets come once both glasses have stayed in theirs."""
    kind = "targets"

    def goals(self, start: Array) -> list[Goal]:
        axes = ["xyz".index(axis) for axis in self.plane]
        found = []
        for k in range(self.count + 1):
            angle = 2.0 * pi * ((k * (self.count // 2 + 1)) % self.count) / self.count
            p = start.copy()
            p[axes[0]] += 0.5 * self.distance * sin(angle)
            p[axes[1]] += 0.5 * self.distance * cos(angle)
            found.append(Goal(k, p, 0.5 * self.width))
        return found

    def hold(self, index: int) -> float:
        return self.dwell

    @property
    def counted(self) -> slice:
        """Goals whose times count."""
        return slice(1, None)


@dataclass(frozen=True)
class Gates:
    """Follow the ring: gates that the glass is to pass through, one behind the other, without a stop. A gate counts as passed when the
    glass's centre has come nearer to its centre than its radius.
    """

    name: str
    gates: tuple[tuple[float, float, float], ...]
    """m, their centres, from the glass's home position."""
    radius: float = 0.04
    """m."""
    timeout: float = 10.0
    """s for a gate."""
    kind, tools = "gates", (0,)

    def goals(self, start: Array) -> list[Goal]:
        return [Goal(k, start + p, self.radius, through=True) for k, p in enumerate(np.array(self.gates))]

    def hold(self, index: int) -> float:
        return 0.0

    @property
    def counted(self) -> slice:
        return slice(None)


@dataclass(frozen=True)
class Carry:
    """Carry the glass to each place, A, B, C, and hold it there."""

    name: str
    places: tuple[tuple[float, float, float], ...]
    """m, from the glass's home position."""
    radius: float = 0.02
    """m: so near the glass's centre is to be."""
    holding: float = 1.0
    """s."""
    timeout: float = 10.0
    """s for a place."""
    kind, tools = "carry", (0,)

    def goals(self, start: Array) -> list[Goal]:
        return [Goal(k, start + p, self.radius) for k, p in enumerate(np.array(self.places))]

    def hold(self, index: int) -> float:
        return self.holding

    @property
    def counted(self) -> slice:
        return slice(None)


Task = Targets | Gates | Carry


@dataclass(frozen=True)
class Reached:
    """What came of a goal."""

    goal: Goal
    begin: float
    """s, when it was shown."""
    end: float
    """s, when the stay in it began; for a gate, when it was passed."""
    done: float
    """s, when it was done with: `end`, and the stay in it."""
    missed: bool
    """The time was up."""
    p: Array
    """(3,), m: where the glass was at `done`."""
    origin: Array
    """(3,), m: where it was at `begin`."""


class Course:
    """A task in progress with one glass. take() gets the position of the glass; goal and following are the goals to show."""

    def __init__(self, task: Task, start: Array) -> None:
        self.task = task
        self.goals = task.goals(np.asarray(start, dtype=float))
        self.reached: list[Reached] = []
        self._glass: Array | None = None
        self._begin: tuple[float, Array] | None = None
        self._inside: float | None = None

    @property
    def goal(self) -> Goal | None:
        k = len(self.reached)
        return self.goals[k] if k < len(self.goals) else None

    @property
    def following(self) -> Goal | None:
        k = len(self.reached) + 1
        return self.goals[k] if k < len(self.goals) else None

    @property
    def over(self) -> bool:
        return self.goal is None

    def take(self, t: float, glass: Array) -> None:
        """The glass's centre (3,), m, at t s."""
        if not self.over and (self.look(t, glass) or self.late(t)):
            self.finish(t)

    def look(self, t: float, glass: Array) -> bool:
        """Whether the goal is reached: the glass, at (3,), m, has stayed in it, or has passed the gate."""
        goal, last, self._glass = self.goal, self._glass, np.array(glass, dtype=float)
        assert goal is not None
        if self._begin is None:
            self._begin = (t, self._glass)
        before = last if goal.through and last is not None else self._glass
        if _distance(goal.p, before, self._glass) > goal.radius:
            self._inside = None
        elif self._inside is None:
            self._inside = t
        return self._held(t)

    def _held(self, t: float) -> bool:
        return self._inside is not None and t - self._inside >= self.task.hold(len(self.reached)) - 1e-9

    def late(self, t: float) -> bool:
        """Whether the time for the goal is up."""
        return self._begin is not None and t - self._begin[0] > self.task.timeout

    def finish(self, t: float) -> None:
        """The goal is done with, reached or missed."""
        assert self._begin is not None and self.goal is not None and self._glass is not None
        (begin, origin), held = self._begin, self._held(t)
        end = self._inside if held and self._inside is not None else t
        self.reached.append(Reached(self.goal, begin, end, t, not held, self._glass, origin))
        self._begin, self._inside = (t, self._glass), None


class Courses:
    """A task in progress with the glass of each of its tools. New goals come for all together, once all are reached."""

    def __init__(self, task: Task, starts: Sequence[Array]) -> None:
        self.each = [Course(task, start) for start in starts]

    @property
    def over(self) -> bool:
        return self.each[0].over

    def take(self, t: float, glasses: Sequence[Array]) -> None:
        """The glasses' centres (3,), m, at t s."""
        if self.over:
            return
        reached = [course.look(t, glass) for course, glass in zip(self.each, glasses)]
        if all(reached) or self.each[0].late(t):
            for course in self.each:
                course.finish(t)


def _distance(p: Array, a: Array, b: Array) -> float:
    """m, from p to the nearest point between a and b."""
    way = b - a
    share = float(np.clip((p - a) @ way / max(float(way @ way), 1e-12), 0.0, 1.0))
    return float(np.linalg.norm(a + share * way - p))
