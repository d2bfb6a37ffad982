"""Tasks of a participant: goals for the glass, in the base's frame, one after another.

Every task has `goals(start)`: the Goals of a trial, m in the base, where start (3,) is the home position of the glass. Course follows
the glass and selects the goal that is shown, the same for people and simulated operators.
"""

from __future__ import annotations

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
    kind = "gates"

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
    kind = "carry"

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
    """A task in progress. take() gets the position of the glass; goal and following are the goals to show."""

    def __init__(self, task: Task, start: Array) -> None:
        self.task = task
        self.goals = task.goals(np.asarray(start, dtype=float))
        self.reached: list[Reached] = []
        self._last: Array | None = None
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
        goal = self.goal
        if goal is None:
            return
        glass = np.array(glass, dtype=float)
        if self._begin is None:
            self._begin = (t, glass)
        if goal.through:
            if _distance(goal.p, glass if self._last is None else self._last, glass) <= goal.radius:
                self._finish(goal, t, t, glass)
        elif np.linalg.norm(glass - goal.p) <= goal.radius:
            if self._inside is None:
                self._inside = t
            if t - self._inside >= self.task.hold(goal.index) - 1e-9:
                self._finish(goal, self._inside, t, glass)
        else:
            self._inside = None
        if self.goal is goal and t - self._begin[0] > self.task.timeout:
            self._finish(goal, t, t, glass, missed=True)
        self._last = glass

    def _finish(self, goal: Goal, end: float, done: float, glass: Array, missed: bool = False) -> None:
        assert self._begin is not None
        begin, origin = self._begin
        self.reached.append(Reached(goal, begin, end, done, missed, glass, origin))
        self._begin, self._inside = (done, glass), None


def _distance(p: Array, a: Array, b: Array) -> float:
    """m, from p to the nearest point between a and b."""
    way = b - a
    share = float(np.clip((p - a) @ way / max(float(way @ way), 1e-12), 0.0, 1.0))
    return float(np.linalg.norm(a + share * way - p))
