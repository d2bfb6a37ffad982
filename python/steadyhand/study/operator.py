"""A simulated operator: sees the glass and the goal where they are shown, and moves a hand in submovements.

The model is the stochastic optimized-submovement model (Meyer, Abrams, Kornblum, Wright & Smith 1988, Psychological Review 95:340):
an aimed movement is a primary submovement and as many corrections as are needed; where a submovement ends scatters with a standard
deviation that grows with its mean speed (signal-dependent noise, SD = noise * distance / duration); and its duration is the one for
which the expected time to the goal is smallest, which is the choice between speed and accuracy. Every submovement has the
minimum-jerk form (Flash & Hogan 1985). Before a correction the operator waits until the result of the last submovement is seen ("move
and wait", Ferrell 1965). The seen scene is old by the visual delay, 150 to 250 ms; the operator knows the delay, as people do after a
training, to within an error of timing.

The page draws the glass, and its target as a ghost. The operator aims with the ghost, which
follows at once; if the glass stops next to the goal, the operator corrects the difference.

With two hands, both answer new goals at once, but a correction needs the eyes on that hand's glass. The eyes look at one glass until it is
in its goal or its correction is under way; to look at the other takes `glance` (Riek, Tresilian, Mon-Williams, Coppard & Carson 2003,
Experimental Brain Research 153:59).

The hand keeps its orientation. Fatigue, learning and care for what is in the glass are not in the model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi, sqrt
from typing import NamedTuple

import numpy as np
from scipy.special import erf

from .._arrays import Array

STEP = 0.01  # s, between two calls of Operator.step()


class Goal(NamedTuple):
    """Where the glass is to go, as it is shown."""

    index: int
    """Counts the goals of a trial."""
    p: Array
    """(3,), m, base: its centre."""
    radius: float
    """m: the glass's centre is to come so near."""
    through: bool = False
    """A gate: to be passed, not to stay at."""


class View(NamedTuple):
    """A picture of the scene."""

    glass: Array
    """(3,), m, base."""
    target: Array
    """(3,), m, base: the ghost."""
    goal: Goal | None
    """None: nothing is to be done."""
    following: Goal | None = None
    """The goal behind it, shown too where goals are gates."""


@dataclass(frozen=True)
class Person:
    """What makes one operator differ from the next."""

    visual_delay: float = 0.2
    """s, from what is shown to the hand's answer."""
    decision: float = 0.08
    """s on top, to turn to a goal that has just appeared."""
    noise: float = 0.03
    """s: standard deviation of where a submovement ends, m, for each m/s of its mean speed."""
    across: float = 0.5
    """That deviation across the direction of movement, as a share of the one along it."""
    acuity: float = 0.001
    """m, standard deviation with which a distance is seen."""
    gain_error: float = 0.0
    """The scale from hand to glass as the operator knows it, over the true one, less 1."""
    timing_error: float = 0.0
    """The machine's latency as the operator knows it, over the true one, less 1."""
    shortest: float = 0.12
    """s, of a submovement."""
    strength: float = 22.0
    """m/s^2, the hand's largest acceleration. At 22, 0.4 m take 0.32 s at least; to a goal of 51 mm people took 0.39 s (Fitts 1954)."""
    watching: float = 0.3
    """s for which the glass must be seen stationary next to its goal before the operator corrects."""
    glance: float = 0.2
    """s, to look from one glass to the other."""

    @staticmethod
    def draw(rng: np.random.Generator) -> Person:
        """One of many."""
        return Person(
            visual_delay=rng.uniform(0.15, 0.25), decision=rng.uniform(0.05, 0.12), noise=rng.uniform(0.02, 0.04),
            across=rng.uniform(0.4, 0.6), acuity=rng.uniform(0.0005, 0.0015), gain_error=float(np.clip(rng.normal(0.0, 0.04), -0.1, 0.1)),
            timing_error=float(np.clip(rng.normal(0.0, 0.15), -0.4, 0.4)), shortest=rng.uniform(0.1, 0.14), watching=rng.uniform(0.2, 0.4),
            strength=rng.uniform(15.0, 30.0),
        )  # fmt: skip


DURATIONS = np.geomspace(0.05, 4.0, 160)  # s, among which durations of submovements are chosen
MISS_Z = 2.0  # a correction is planned to end inside the goal within so many standard deviations


def expected_times(distance: float, width: float, noise: float, feedback: float, durations: Array = DURATIONS) -> Array:
    """s: primary submovements of these durations and what their corrections take on average (Meyer et al. 1988).

    distance, width: m, of the movement and of the goal along it. noise: s, as Person's. feedback: s that pass between a submovement
    and its correction.
    """
    deviation = noise * distance / durations
    z = width / (2.0 * deviation)
    misses = 1.0 - erf(z / sqrt(2.0))
    away = deviation * sqrt(2.0 / pi) * np.exp(-0.5 * z**2)  # mean distance of the misses, times their probability
    return durations + misses * feedback + 2.0 * MISS_Z * noise * away / width


def chosen_duration(distance: float, width: float, noise: float, feedback: float, shortest: float) -> float:
    """s: for which the expected time is smallest."""
    return max(shortest, float(DURATIONS[np.argmin(expected_times(distance, width, noise, feedback))]))


PEAK_ACCELERATION = 10.0 / sqrt(3.0)  # peak of a minimum-jerk movement, times duration^2 / distance


def minimum_jerk(s: float) -> float:
    """Share of a movement that is done after a share s of its duration."""
    s = min(max(s, 0.0), 1.0)
    return s**3 * (10.0 + s * (6.0 * s - 15.0))


class _Submovement(NamedTuple):
    start: float  # s
    duration: float  # s
    displacement: Array  # (3,), m, of the hand

    def at(self, t: float) -> Array:
        return minimum_jerk((t - self.start) / self.duration) * self.displacement


class Operator:
    """One person at the controls. step() is called every STEP seconds.

    scale: m of the glass for each m of the hand. latency: s, what the machine adds between hand and picture on purpose; the operator
    has learnt it in the training, to within Person.timing_error.
    """

    STILL = 0.003  # m: a glass that moved less than this while it was watched counts as stationary
    OVERLAP = 0.7  # share of a submovement through a gate after which the next one begins

    def __init__(self, person: Person, scale: float, latency: float, rng: np.random.Generator) -> None:
        self.person, self._rng = person, rng
        self._scale = scale * (1.0 + person.gain_error)
        self._machine = latency * (1.0 + person.timing_error)
        self._views: list[View] = []
        self._hands: list[Array] = []
        self._base = np.zeros(3)
        self._moves: list[_Submovement] = []
        self._ended = -np.inf  # s, when the last submovement was over
        self._aimed = -1  # index of the goal of the last submovement
        self._missed = -1  # index of the goal that was corrected for last
        self._offset = np.zeros(3)  # m, of the glass from the ghost at rest
        self._turn_at: float | None = None  # s, when a goal just seen is answered
        self.submovements = 0
        self._unseen = False  # the eyes must come back to this glass

    @property
    def needs_eyes(self) -> bool:
        """A submovement is over, and its end must be looked at."""
        return self._unseen and not self._moves

    def step(self, view: View, looks: bool = True) -> Array:
        """Where the hand is now, (3,), m, from where it gripped. view: what is shown now. looks: the eyes are on this hand's glass."""
        self._views.append(view)
        t = STEP * len(self._hands)
        while self._moves and t >= self._moves[0].start + self._moves[0].duration:
            done = self._moves.pop(0)
            self._base = self._base + done.displacement
            self._ended = done.start + done.duration
        lag = round(self.person.visual_delay / STEP)
        if len(self._views) > lag:
            self._decide(t, len(self._views) - 1 - lag, looks)
        hand = self._base + sum((move.at(t) for move in self._moves), np.zeros(3))
        self._hands.append(hand)
        return hand

    def _decide(self, t: float, newest: int, looks: bool) -> None:
        """newest: index of the newest picture that has been seen."""
        seen = self._views[newest]
        goal = seen.goal
        if goal is None:
            return
        if self._moves:
            self._overlap(t, seen)
            return
        if goal.index > self._aimed:
            if self._turn_at is None:
                self._turn_at = t + self.person.decision
            if t >= self._turn_at:
                self._turn_at = None
                self._move(t, seen.target, goal)
            return
        self._turn_at = None
        # A correction starts once the display shows the end of the last submovement.
        shown = t - self.person.visual_delay - self._machine
        if shown < self._ended:
            return
        self._unseen = self._unseen and not looks
        self._missed = goal.index  # once missed, a gate is waited at
        if np.linalg.norm(goal.p - seen.target - self._offset) > 0.8 * goal.radius:
            if looks:
                self._move(t, seen.target, goal)
            else:
                self._unseen = True  # that it is not in its goal is noticed, too, where the eyes are not
        elif np.linalg.norm(goal.p - seen.glass) > goal.radius and shown > self._ended + self.person.watching:
            before = self._views[newest - round(self.person.watching / STEP)]
            if np.linalg.norm(seen.glass - before.glass) < self.STILL:
                self._offset = seen.glass - seen.target
                self._move(t, seen.target, goal)

    def _overlap(self, t: float, seen: View) -> None:
        """Through a gate one does not stop."""
        last, goal, following = self._moves[-1], seen.goal, seen.following
        if following is None or goal is None or not goal.through or len(self._moves) > 1:
            return
        if self._aimed != goal.index or self._missed == goal.index:
            return
        if t >= last.start + self.OVERLAP * last.duration:
            self._move(t, seen.target, following)

    def _move(self, t: float, target: Array, goal: Goal) -> None:
        """A submovement towards the goal, from where the ghost will be once all of the hand's motion so far has come through."""
        person, rng = self.person, self._rng
        then = len(self._hands) - 1 - round((person.visual_delay + self._machine) / STEP)
        felt = self._hands[max(then, 0)] if self._hands else np.zeros(3)
        ahead = self._base + sum((move.displacement for move in self._moves), np.zeros(3)) - felt
        if goal.index != self._aimed:
            self._offset = np.zeros(3)
        wanted = (goal.p - self._offset + rng.normal(0.0, person.acuity, 3) - target) / self._scale - ahead
        distance = float(np.linalg.norm(wanted))
        self._aimed = goal.index
        if distance < 1e-4:
            return
        feedback = person.visual_delay + self._machine
        width = 2.0 * goal.radius / abs(self._scale)
        shortest = max(person.shortest, sqrt(PEAK_ACCELERATION * distance / person.strength))
        duration = chosen_duration(distance, width, person.noise, feedback, shortest)
        deviation = person.noise * distance / duration
        along = wanted / distance
        scatter = rng.normal(0.0, deviation * person.across, 3)
        scatter += along * (rng.normal(0.0, deviation) - scatter @ along)
        self._moves.append(_Submovement(t, duration, wanted + scatter))
        self.submovements += 1
        self._unseen = True


class Hands:
    """The hands of one person, for a goal each. step() as Operator's, with a view for each hand."""

    def __init__(self, person: Person, scale: float, latency: float, rng: np.random.Generator, count: int) -> None:
        self.each = [Operator(person, scale, latency, rng) for _ in range(count)]
        self._glance = round(person.glance / STEP)
        self._eyes = self._wait = 0  # hand that is looked at, and steps until the eyes are there

    def step(self, views: Sequence[View]) -> list[Array]:
        hands = [hand.step(view, k == self._eyes and self._wait == 0) for k, (hand, view) in enumerate(zip(self.each, views))]
        self._wait = max(0, self._wait - 1)
        needs = [hand.needs_eyes for hand in self.each]
        if any(needs) and not needs[self._eyes]:
            self._eyes, self._wait = needs.index(True), self._glance
        return hands
