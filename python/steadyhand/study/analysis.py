"""From a study's folder to results: tables of participant x condition, and what the statistics say of them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .._arrays import Array
from .._files import csv_of, write_whole
from . import statistics as st
from .measures import BY_NAME, MEASURES, Measure
from .questionnaires import TLX_SCALES, sus_score, tlx_score, tlx_weights
from .record import Folder, trial_rows
from .run import schedule_of
from .study_file import Study, StudyError, load_study
from .tasks import Task


ALL_TASKS = "all tasks"


class Trials(NamedTuple):
    """What was measured. goals: rows of single goals, (condition, task, distance m, width m, movement time s)."""

    values: dict[tuple[str, str, str, str], list[float]]
    """By participant, condition, task, measure: of each counted trial."""
    periods: dict[tuple[str, str], int]
    """By participant, condition: place in the order."""
    goals: list[tuple[str, str, float, float, float]]
    files: int


class FittsLine(NamedTuple):
    """movement time = intercept + slope * ID, over means for each index of difficulty, log2(distance / width + 1)."""

    intercept: float
    slope: float
    r2: float
    ids: list[float]
    times: list[float]


@dataclass(frozen=True)
class Analysed:
    """A measure of a task."""

    task: str
    measure: Measure
    values: Array
    """(participants, conditions), means over trials; of logarithms where the measure is logarithmic."""
    means: list[st.Estimate]
    """For each condition, in the measure's unit; geometric where it is logarithmic."""
    model: list[st.Contrast]
    friedman: st.Omnibus | None
    pairs: list[st.Pair]

    @property
    def counts(self) -> list[int]:
        """Number of participants of each condition."""
        return [int(n) for n in np.isfinite(self.values).sum(axis=0)]

    def shown(self, estimate: st.Estimate) -> st.Estimate:
        """A difference as a ratio where the measure is logarithmic."""
        return st.Estimate(*np.exp(estimate)) if self.measure.logarithmic else estimate


@dataclass(frozen=True)
class Results:
    study: Study
    simulated: bool
    participants: list[str]
    missing: int
    """Trials of the schedule that are not there."""
    analysed: list[Analysed]
    fitts: dict[str, FittsLine]
    """By condition, over all tasks with targets; where there are three indices of difficulty or more."""


def open_study(out: Path) -> tuple[Study, bool]:
    """The study that a folder holds, and whether its participants are simulated."""
    kept = Path(out) / "study.yaml"
    try:
        head = kept.read_text(encoding="utf-8").split("\n", 1)[0]
        participants = int(head.split()[1])
    except (OSError, UnicodeDecodeError, IndexError, ValueError):
        raise StudyError(f"{out} is no folder of a study: it has no study.yaml that `study` wrote") from None
    return load_study(kept, participants), "simulated" in head.split()


def read_trials(out: Path) -> Trials:
    """Every finished trial. Raises StudyError with file and line for what does not fit."""
    values: dict[tuple[str, str, str, str], list[float]] = {}
    periods: dict[tuple[str, str], int] = {}
    goals = []
    files = sorted(Path(out).glob("participants/*/trials/*.csv"))
    for path in files:
        single: dict[int, dict[str, float]] = {}
        for row in trial_rows(path):
            if row.repetition == 0:
                continue
            who, condition, task = row.participant, row.condition, row.task
            periods[who, condition] = row.period
            if row.goal >= 0:
                single.setdefault(row.goal, {})[row.measure] = row.value
            elif row.measure in BY_NAME:
                values.setdefault((who, condition, task, row.measure), []).append(row.value)
        for k, each in single.items():
            if each.get("goal_missed") == 0.0 and k > 0:
                goals.append((condition, task, each["distance"], each["width"], each["movement_time"]))
    return Trials(values, periods, goals, len(files))


def _table(trials: Trials, people: list[str], conditions: list[str], task: str, measure: Measure) -> Array:
    table = np.full((len(people), len(conditions)), np.nan)
    for i, who in enumerate(people):
        for j, condition in enumerate(conditions):
            found = np.array(trials.values.get((who, condition, task, measure.name), []))
            found = found[np.isfinite(found) & ((found > 0.0) | (not measure.logarithmic))]
            if len(found):
                table[i, j] = np.mean(np.log(found)) if measure.logarithmic else np.mean(found)
    return table


def analyse_table(task: str, measure: Measure, values: Array, conditions: list[str], reference: str, periods: Array | None) -> Analysed:
    means = []
    for column in values.T:
        estimate = st.mean(column[np.isfinite(column)]) if np.isfinite(column).any() else st.Estimate(*[float("nan")] * 3)
        means.append(st.Estimate(*np.exp(estimate)) if measure.logarithmic else st.Estimate(*np.clip(estimate, measure.least, measure.most).tolist()))
    return Analysed(task, measure, values, means, st.mixed_model(values, conditions, reference, periods), st.friedman(values), st.pairs(values, conditions))


def fitts_line(goals: list[tuple[str, str, float, float, float]]) -> FittsLine | None:
    """Over tasks, which are the indices of difficulty: nominal ones, of the mean distance."""
    by_task: dict[str, list[tuple[float, float, float]]] = {}
    for _, task, distance, width, time in goals:
        by_task.setdefault(task, []).append((distance, width, time))
    ids = [float(np.log2(np.mean([d for d, _, _ in rows]) / rows[0][1] + 1.0)) for rows in by_task.values()]
    times = [float(np.mean([t for _, _, t in rows])) for rows in by_task.values()]
    if len(set(np.round(ids, 3))) < 3:
        return None
    slope, intercept = np.polyfit(ids, times, 1)
    return FittsLine(float(intercept), float(slope), float(np.corrcoef(ids, times)[0, 1] ** 2), ids, times)


def _questionnaires(study: Study, folder: Folder, people: list[str], conditions: list[str]) -> list[tuple[Measure, Array]]:
    answers: dict[tuple[str, str], dict[str, int]] = {}
    for who in people:
        for row in folder.answers(who):
            answers.setdefault((who, row["condition"]), {})[row["key"]] = int(row["value"])
    found = []

    def add(name: str, label: str, better: int, least: float, most: float, score) -> None:  # type: ignore[no-untyped-def]
        table = np.full((len(people), len(conditions)), np.nan)
        for i, who in enumerate(people):
            for j, condition in enumerate(conditions):
                try:
                    table[i, j] = score(answers.get((who, condition), {}), answers.get((who, ""), {}))
                except (KeyError, ValueError):
                    pass
        if np.isfinite(table).any():
            found.append((Measure(name, label, "", better, False, least, most), table))

    add("tlx_raw", "NASA-TLX, raw", -1, 0.0, 100.0, lambda here, whole: tlx_score(here))
    add("tlx_weighted", "NASA-TLX, weighted", -1, 0.0, 100.0, lambda here, whole: tlx_score(here, tlx_weights(whole)))
    for key in TLX_SCALES:
        add(f"tlx_{key}", f"NASA-TLX, {key}", -1, 0.0, 100.0, lambda here, whole, key=key: 5.0 * here[f"tlx_{key}"])
    add("sus", "System Usability Scale", 1, 0.0, 100.0, lambda here, whole: sus_score(here))
    for each in study.likert:
        add(f"likert_{each.name}", each.statement, 1, 1.0, each.points, lambda here, whole, name=each.name: here[f"likert_{name}"])
    return found


def analyse(out: Path) -> Results:
    """Raises StudyError for a folder that holds no study, and for one without a finished trial."""
    study, simulated = open_study(out)
    folder = Folder(Path(out))
    trials = read_trials(out)
    if not trials.values:
        raise StudyError(f"{out} has no finished trial yet")
    people = sorted({key[0] for key in trials.values})
    conditions = [each.name for each in study.conditions]
    periods = np.array([[trials.periods.get((who, condition), np.nan) for condition in conditions] for who in people])
    schedule = [[trial for trial in each if trial.repetition > 0 or not simulated] for each in schedule_of(study)]
    folder.check_schedule(schedule)
    scheduled = sum(not folder.deleted(trial.participant) for each in schedule for trial in each)
    analysed = []
    by_measure: dict[Measure, list[Array]] = {}
    for task in study.tasks:
        for measure in MEASURES:
            values = _table(trials, people, conditions, task.name, measure)
            if np.isfinite(values).any():
                analysed.append(analyse_table(task.name, measure, values, conditions, study.reference, periods))
                by_measure.setdefault(measure, []).append(values)
    for measure, tables in by_measure.items():
        values = np.mean(tables, axis=0)  # NaN if a participant lacks a task: all must have the same tasks
        if len(tables) > 1 and np.isfinite(values).any():
            analysed.append(analyse_table(ALL_TASKS, measure, values, conditions, study.reference, periods))
    for measure, values in _questionnaires(study, folder, people, conditions):
        analysed.append(analyse_table("questionnaires", measure, values, conditions, study.reference, periods))
    targets = {task.name for task in study.tasks if task.kind == "targets"}
    fitts = {}
    for condition in conditions:
        line = fitts_line([each for each in trials.goals if each[0] == condition and each[1] in targets])
        if line is not None:
            fitts[condition] = line
    return Results(study, simulated, people, scheduled - trials.files, analysed, fitts)


def write_tables(results: Results, out: Path) -> None:
    """summary.csv, and contrasts.csv: what the report shows, for other programs."""
    rows, contrasts = [], []

    def contrast_row(each: Analysed, by: str, a: str, b: str, difference: st.Estimate, *more: float | str) -> None:
        kind, unit = ("ratio", "") if each.measure.logarithmic else ("difference", each.measure.unit)
        contrasts.append((each.task, each.measure.name, by, a, b, kind, *map(float, each.shown(difference)), unit, *more))

    for each in results.analysed:
        for condition, mean, n in zip(results.study.conditions, each.means, each.counts):
            rows.append((each.task, each.measure.name, each.measure.unit, condition.name, *map(float, mean), n))
        for contrast in each.model:
            contrast_row(each, "mixed model", contrast.name, contrast.reference, contrast.difference, contrast.p, "", "")
        for pair in each.pairs:
            contrast_row(each, "pair", pair.a, pair.b, pair.difference, pair.p, pair.p_holm, pair.n)
    write_whole(Path(out) / "summary.csv", csv_of(("task", "measure", "unit", "condition", "mean", "low", "high", "n"), rows))
    write_whole(Path(out) / "contrasts.csv", csv_of(("task", "measure", "by", "condition", "reference", "kind", "value", "low", "high", "unit", "p", "p_holm", "n"), contrasts))


__all__ = ["Analysed", "FittsLine", "Results", "Task", "analyse", "fitts_line", "open_study", "read_trials", "write_tables"]
