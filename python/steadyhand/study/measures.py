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


MEASURES = (
    Measure("completion_time", "Completion time", "s", -1, True),
    Measure("throughput", "Throughput (ISO 9241-411)", "bit/s", 1, False, 0.0),
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
UNDEFINED = ("throughput", "smoothness")
"""Measures that are NaN of a trial that is too short for them. Every other value of a trial is finite."""


class Row(NamedTuple):
    """A row of a trial's tidy CSV. goal: -1 for the whole trial."""

    goal: int
    measure: str
    value: float
    unit: str


def throughput(reached: Sequence[Reached]) -> float:
    """bit/s, of a sequence of reaches: log2(A_e / W_e + 1) / mean movement time, with W_e = 4.133 standard deviations of where reaches
    end along the way from origin to goal, and A_e the mean way (ISO 9241-411, annex B). NaN of fewer than three.
    """
    if len(reached) < 3:
        return float("nan")
    ways, ends = [], []
    for each in reached:
        way = each.goal.p - each.origin
        length = float(np.linalg.norm(way))
        ends.append(float((each.p - each.goal.p) @ way) / length)
        ways.append(length + ends[-1])
    width = 4.133 * float(np.std(ends, ddof=1))
    time = float(np.mean([each.end - each.begin for each in reached]))
    if width <= 0.0 or time <= 0.0:
        return float("nan")
    return float(np.log2(np.mean(ways) / width + 1.0)) / time


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
    """Rows of the trial's CSV: for each goal the time to it, its distance, width and error; then the trial's measures."""
    rows = []
    for each in course:
        rows += [
            Row(each.goal.index, "movement_time", each.end - each.begin, "s"),
            Row(each.goal.index, "distance", float(np.linalg.norm(each.goal.p - each.origin)), "m"),
            Row(each.goal.index, "width", 2.0 * each.goal.radius, "m"),
            Row(each.goal.index, "error", float(np.linalg.norm(each.p - each.goal.p)), "m"),
            Row(each.goal.index, "goal_missed", float(each.missed), ""),
        ]
    counted = course[task.counted]
    track = trial.track
    glass, target = np.array(track.glass), np.array(track.target)
    steps = np.linalg.norm(np.diff(glass, axis=0), axis=1)
    whole = {
        "completion_time": sum(each.end - each.begin for each in counted),
        "path_length": float(steps.sum()),
        "smoothness": sparc(steps / dt, dt),
        "spilled_share": trial.spilled_share,
        "tracking_error": float(np.sqrt(np.mean(np.sum((glass - target) ** 2, axis=1)))),
        "held_back": float(np.mean([each != "none" for each in track.held_back])),
        "collisions_prevented": float(episodes([each in ("self_collision", "obstacle") for each in track.held_back])),
        "missed": float(sum(each.missed for each in course)),
        "submovements": float(trial.submovements),
    }
    if task.kind == "targets":
        whole["throughput"] = throughput([each for each in counted if not each.missed])
    rows += [Row(-1, each.name, whole[each.name], each.unit) for each in MEASURES if each.name in whole]
    return rows


__all__ = ["BY_NAME", "Course", "MEASURES", "Measure", "Row", "episodes", "measure", "sparc", "throughput"]
