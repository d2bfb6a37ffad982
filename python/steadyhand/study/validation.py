"""The simulated operator beside what is published: the model's own figure, Fitts's law, and what added latency costs."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from math import pi, sqrt
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .._arrays import Array
from .._robot import Robot
from .analysis import FittsLine, fitts_line
from .measures import throughput
from .one_instant_ik import OneInstantIk
from .operator import DURATIONS, MISS_Z, STEP, Person, chosen_duration, expected_times, minimum_jerk
from .tasks import Targets
from .trial import CONTROL, ONE_INSTANT_IK, Assisted, Condition, run_trial

DISTANCES, WIDTHS = (0.08, 0.15, 0.25), (0.012, 0.02, 0.032, 0.05)  # m; twelve indices of difficulty
LATENCIES = (0.0, 0.05, 0.1, 0.2, 0.4)  # s

# MacKenzie & Ware 1993, "Lag as a determinant of human performance in interactive systems", INTERCHI '93: a mouse on a screen.
# Lag in s, movement time in s, effective throughput ("bandwidth") in bit/s.
PUBLISHED_LAG = ((0.0083, 0.911, 4.3), (0.025, 0.934, 4.1), (0.075, 1.059, 3.5), (0.225, 1.493, 2.3))


class ModelPoint(NamedTuple):
    """Of aimed movements without delay: mean durations, s, by the theory and of simulated movements."""

    ratio: float
    """Distance over width."""
    theory: float
    theory_primary: float
    total: float
    primary: float
    square_root: float
    """The closed form for large ratios, 2 K sqrt(2 z sqrt(2 / pi)) sqrt(distance / width)."""


def model_figure(noise: float = 0.03, movements: int = 20_000, seed: int = 1) -> list[ModelPoint]:
    """The model's prediction of mean total and primary durations over distance / width (Meyer et al. 1988): what theory says, and what
    movements come to that scatter and are corrected as the operator's are.
    """
    rng = np.random.default_rng(seed)
    found = []
    for ratio in (2.0, 4.0, 8.0, 16.0, 24.0, 32.0):
        distance, width = ratio, 1.0
        fine = np.geomspace(DURATIONS[0], DURATIONS[-1], 4000)
        expected = expected_times(distance, width, noise, 0.0, fine)
        primary = chosen_duration(distance, width, noise, 0.0, 0.0)
        error = rng.normal(0.0, noise * distance / primary, movements)
        total = np.full(movements, primary)
        for _ in range(20):
            missed = np.flatnonzero(np.abs(error) > 0.5 * width)
            if not len(missed):
                break
            away = np.abs(error[missed])
            duration = 2.0 * MISS_Z * noise * away / width
            total[missed] += duration
            error[missed] = rng.normal(0.0, noise * away / duration)
        closed = 2.0 * noise * sqrt(2.0 * MISS_Z * sqrt(2.0 / pi)) * sqrt(ratio)
        found.append(ModelPoint(ratio, float(expected.min()), float(fine[np.argmin(expected)]), float(total.mean()), primary, closed))
    return found


def _operator(arguments: tuple[int, int, str, float, str]) -> tuple[list[tuple[str, str, float, float, float]], list[float]]:
    """Goals, and throughputs of sequences, of one operator."""
    number, seed, profile, latency, path = arguments
    robot = Robot("ur5e")
    person = Person.draw(np.random.default_rng([seed, number]))
    condition = Condition("", profile, latency=latency, path=path)
    goals, throughputs = [], []
    for i, (distance, width) in enumerate((d, w) for d in DISTANCES for w in WIDTHS):
        task = Targets(f"{distance:g}/{width:g}", distance, width)
        trial = run_trial(robot, condition, task, person, np.random.default_rng([seed, number, i, round(1e3 * latency)]))
        counted = [each for each in trial.reached[task.counted] if not each.missed]
        goals += [("", task.name, float(np.linalg.norm(r.goal.p - r.origin)), width, r.end - r.begin) for r in counted]
        throughputs.append(throughput(counted))
    return goals, throughputs


class LagRow(NamedTuple):
    latency: float
    line: FittsLine
    movement_time: float
    throughput: float


def lag_table(operators: int, profile: str = "follow", path: str = "command", latencies: tuple[float, ...] = LATENCIES, seed: int = 1, jobs: int = 1) -> list[LagRow]:
    """Fitts's law and throughput in closed loop with the planner, at each added latency (s)."""
    rows = []
    for latency in latencies:
        arguments = [(n, seed, profile, latency, path) for n in range(operators)]
        if jobs == 1:
            done = [_operator(each) for each in arguments]
        else:
            with ProcessPoolExecutor(jobs) as pool:
                done = list(pool.map(_operator, arguments))
        goals = [goal for found, _ in done for goal in found]
        line = fitts_line(goals)
        assert line is not None
        rows.append(LagRow(latency, line, float(np.mean([g[-1] for g in goals])), float(np.nanmean([t for _, found in done for t in found]))))
    return rows


def settling(profile: str, rate: float = 50.0, seconds: float = 6.0) -> float:
    """s from the end of a reach of 0.2 m in 0.5 s (of the glass) to where the glass stays within 10 mm of its place; `seconds` less the
    reach: it does not in that time.
    """
    robot = Robot("ur5e")
    condition = Condition("", profile)
    machine = OneInstantIk(robot, condition.scale) if profile == ONE_INSTANT_IK else Assisted(robot, condition, rate)
    T, place, late = np.eye(4), robot.fk(robot.home)[:3, 3] + [0.0, 0.2, 0.0], 0.0
    for k in range(round(seconds / STEP)):
        t = k * STEP
        T[1, 3] = 0.2 / condition.scale * minimum_jerk(t / 0.5)
        machine.feed(T, t, True)
        for i in range(round(STEP / CONTROL)):
            q, _, _ = machine.update(t + i * CONTROL)
        if np.abs(robot.fk(q)[:3, 3] - place).max() > 0.01:
            late = t + STEP
    return late - 0.5


def lag_text(rows: list[LagRow]) -> str:
    text = "added latency, ms   movement time, s   throughput, bit/s   of the first   intercept, s   slope, s/bit   r2\n"
    for row in rows:
        text += (f"{1e3 * row.latency:17.0f}   {row.movement_time:16.3f}   {row.throughput:17.2f}   {row.throughput / rows[0].throughput:12.2f}"
                 f"   {row.line.intercept:12.3f}   {row.line.slope:13.3f}   {row.line.r2:.3f}\n")  # fmt: skip
    text += "\nMacKenzie & Ware 1993, a mouse on a screen:\n"
    for lag, time, bits in PUBLISHED_LAG:
        text += f"{1e3 * lag:17.1f}   {time:16.3f}   {bits:17.2f}   {bits / PUBLISHED_LAG[0][2]:12.2f}\n"
    return text


def model_text(points: list[ModelPoint]) -> str:
    text = "distance/width   total: theory   simulated   primary: theory   simulated   square-root law, s\n"
    for p in points:
        text += f"{p.ratio:14.0f}   {p.theory:13.3f}   {p.total:9.3f}   {p.theory_primary:15.3f}   {p.primary:9.3f}   {p.square_root:18.3f}\n"
    return text


def plot(points: list[ModelPoint], rows: list[LagRow], path: Path) -> None:
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    figure, (left, middle, right) = pyplot.subplots(1, 3, figsize=(13, 3.9), layout="constrained")
    root: Array = np.sqrt([p.ratio for p in points])
    left.plot(root, [p.theory for p in points], "-", color="#1d2530", label="total, theory")
    left.plot(root, [p.total for p in points], "o", color="#1d2530", label="total, simulated")
    left.plot(root, [p.theory_primary for p in points], "-", color="#2f6fb0", label="primary, theory")
    left.plot(root, [p.primary for p in points], "o", color="#2f6fb0", label="primary, simulated")
    left.plot(root, [p.square_root for p in points], ":", color="#55616f", label="square-root law")
    left.set(xlabel="square root of distance / width", ylabel="mean duration, s", title="Meyer et al. 1988")
    for n, row in enumerate(rows):
        middle.plot(row.line.ids, row.line.times, "o", ms=4, color=f"C{n}")
        ends = np.array([min(row.line.ids), max(row.line.ids)])
        middle.plot(ends, row.line.intercept + row.line.slope * ends, "-", lw=1, color=f"C{n}", label=f"{1e3 * row.latency:.0f} ms: r² {row.line.r2:.2f}")
    middle.set(xlabel="index of difficulty, bit", ylabel="movement time, s", title="In closed loop, latency added")
    right.plot([1e3 * r.latency for r in rows], [r.throughput / rows[0].throughput for r in rows], "o-", label="simulated operators")
    right.plot([1e3 * lag for lag, _, _ in PUBLISHED_LAG], [b / PUBLISHED_LAG[0][2] for _, _, b in PUBLISHED_LAG], "s--", color="#c2571a", label="MacKenzie & Ware 1993")
    right.set(xlabel="added latency, ms", ylabel="throughput, of that without", ylim=(0, 1.05), title="What latency costs")
    for axes in (left, middle, right):
        axes.legend(frameon=False, fontsize=8)
        axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=110)
    pyplot.close(figure)
