"""Measures of a trial. All use the motion of the glass, from the time the first goal is shown to the end of the last."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .._arrays import Array
from .tasks import Course, Reached, Task
from .trial import Trial


class Measure(NamedTuple):
    name: str
    label: str
    unit: str
    better: int
    """1: more is better, -1: less is."""
    logarithmic: bool
    """Differences are ratios: analysed as logarithms."""
    least: float = -math.inf
    most: float = math.inf
    """No mean can lie outside: its interval ends there (which leaves the interval's coverage as it is)."""


HANDS = ("first", "second")  # in the order of a task's tools
MEASURES = (
    Measure("completion_time", "Completion time", "s", -1, True),
    Measure("throughput", "Throughput (ISO 9241-411)", "bit/s", 1, False, 0.0),
    Measure("throughput_first", "Throughput of the first hand", "bit/s", 1, False, 0.0),
    Measure("throughput_second", "Throughput of the second hand", "bit/s", 1, False, 0.0),
    Measure("gap", "Time between the hands' reaches", "s", -1, False, 0.0),
    Measure("path_length", "Path length", "m", -1, True),
    Measure("smoothness", "Smoothness (SPARC)", "", 1, False),
    Measure("spilled_share", "Spilled share of the liquid", "", -1, False, 0.0, 1.0),
    Measure("tracking_error", "Tracking error, RMS", "m", -1, True),
    Measure("held_back", "Share of time with an active limit", "", -1, False, 0.0, 1.0),
    Measure("collisions_prevented", "Collisions prevented", "", -1, False, 0.0),
    Measure("missed", "Goals missed", "", -1, False, 0.0),
    Measure("submovements", "Submovements", "", -1, False, 0.0),
)
BY_NAME = {each.name: each for each in MEASURES}
UNDEFINED = ("throughput", *(f"throughput_{name}" for name in HANDS), "gap", "smoothness")
"""Measures that are NaN of a trial that is too short for them. Every other value of a trial is finite."""


class Row(NamedTuple):
    """A row of a trial's tidy CSV. goal: -1 for the whole trial."""

    goal: int
    measure: str
    value: float
    unit: str


def throughput(*hands: Sequence[Reached]) -> float:
    """bit/s, of a sequence of reaches: log2(A_e / W_e + 1) / mean movement time, with W_e = 4.133 standard deviations of where reaches
    end along the way from origin to goal, and A_e the mean way (ISO 9241-411, annex B). NaN of fewer than three.

    Of several hands that reach at the same time: the sum of their log2(A_e / W_e + 1), over the mean time until all have reached.
    """
    if len(hands[0]) < 3:
        return float("nan")
    time = float(np.mean([max(each.end for each in reaches) - reaches[0].begin for reaches in zip(*hands)]))
    return sum(map(difficulty, hands)) / time if time > 0.0 else float("nan")


def difficulty(reached: Sequence[Reached]) -> float:
    """bit: effective index of difficulty, log2(A_e / W_e + 1). NaN if all end at the same place."""
    ways, ends = [], []
    for each in reached:
        way = each.goal.p - each.origin
        length = float(np.linalg.norm(way))
        ends.append(float((each.p - each.goal.p) @ way) / length)
        ways.append(length + ends[-1])
    width = 4.133 * float(np.std(ends, ddof=1))
    return float(np.log2(np.mean(ways) / width + 1.0)) if width > 0.0 else float("nan")


def sparc(speed: Array, dt: float, cutoff: float = 10.0, threshold: float = 0.05) -> float:
    """Spectral arc length of a speed profile: 0 is smoothest (Balasubramanian, Melendez-Calderon, Roby-Brami & Burdet 2015).

    cutoff: Hz; threshold: share of the spectrum's value at 0 below which its tail does not count.
    """
    speed = np.asarray(speed, dtype=float)
    if len(speed) < 4 or not np.any(speed > 0.0):
        return float("nan")
    n = 2 ** (int(np.ceil(np.log2(len(speed)))) + 4)
    frequency = np.arange(n // 2) / (n * dt)
    spectrum = np.abs(np.fft.rfft(speed, n))[: n // 2]
    spectrum = spectrum / spectrum[0]
    keep = frequency <= cutoff
    frequency, spectrum = frequency[keep], spectrum[keep]
    above = np.flatnonzero(spectrum >= threshold)
    frequency, spectrum = frequency[: above[-1] + 1], spectrum[: above[-1] + 1]
    if len(frequency) < 2:
        return float("nan")
    return -float(np.sum(np.hypot(np.diff(frequency) / (frequency[-1] - frequency[0]), np.diff(spectrum))))


def episodes(flags: Sequence[bool]) -> int:
    """How often something begins."""
    return sum(1 for last, now in zip((False, *flags), flags) if now and not last)


def measure(task: Task, course: Sequence[Reached], trial: Trial, dt: float) -> list[Row]:
    """Rows of the trial's CSV: for each goal the time to it, its distance, width and error; then the trial's measures.

    A goal of two hands is reached once both have reached theirs; its distance and error are means of both. Of a trial of two hands,
    path lengths and submovements are sums, smoothness and the spilled share are means.
    """
    hands = [trial, *trial.others]
    courses = [course, *(each.reached for each in trial.others)]
    rows = []
    for both in zip(*courses):
        goal = both[0].goal
        rows += [
            Row(goal.index, "movement_time", max(each.end for each in both) - both[0].begin, "s"),
            Row(goal.index, "distance", float(np.mean([np.linalg.norm(each.goal.p - each.origin) for each in both])), "m"),
            Row(goal.index, "width", 2.0 * goal.radius, "m"),
            Row(goal.index, "error", float(np.mean([np.linalg.norm(each.p - each.goal.p) for each in both])), "m"),
            Row(goal.index, "goal_missed", float(any(each.missed for each in both)), ""),
        ]
        if len(both) > 1:
            rows += [Row(goal.index, f"movement_time_{name}", each.end - each.begin, "s") for name, each in zip(HANDS, both)]
    counted = list(zip(*courses))[task.counted]
    track = trial.track
    steps = [np.linalg.norm(np.diff(np.array(each.track.glass), axis=0), axis=1) for each in hands]
    errors = np.array([np.sum((np.array(each.track.glass) - np.array(each.track.target)) ** 2, axis=1) for each in hands])
    whole = {
        "completion_time": sum(max(each.end for each in both) - both[0].begin for both in counted),
        "path_length": float(sum(each.sum() for each in steps)),
        "smoothness": float(np.mean([sparc(each / dt, dt) for each in steps])),
        "spilled_share": float(np.mean([each.spilled_share for each in hands])),
        "tracking_error": float(np.sqrt(np.mean(errors))),
        "held_back": float(np.mean([each != "none" for each in track.held_back])),
        "collisions_prevented": float(episodes([each in ("self_collision", "obstacle") for each in track.held_back])),
        "missed": float(sum(any(each.missed for each in both) for both in zip(*courses))),
        "submovements": float(sum(each.submovements for each in hands)),
    }
    if task.kind == "targets":
        reached = [both for both in counted if not any(each.missed for each in both)]
        by_hand = list(zip(*reached)) or [()]
        whole["throughput"] = throughput(*by_hand)
        if len(hands) > 1:
            whole |= {f"throughput_{name}": throughput(each) for name, each in zip(HANDS, by_hand)}
            whole["gap"] = float(np.mean([abs(a.end - b.end) for a, b in reached])) if reached else float("nan")
    rows += [Row(-1, each.name, whole[each.name], each.unit) for each in MEASURES if each.name in whole]
    return rows


__all__ = ["BY_NAME", "Course", "MEASURES", "Measure", "Row", "episodes", "measure", "sparc", "throughput"]
