"""A study from its schedule to its files, with simulated participants; `lead` (live.py) does it with people."""

from __future__ import annotations

import sys
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

from .measures import measure
from .operator import STEP, Person
from .order import orders
from .record import Folder, Planned, to_mcap
from .study_file import Study, StudyError, load_study
from .trial import ONE_INSTANT_IK, run_trial


def participant_id(index: int) -> str:
    return f"P{index + 1:02}"


def schedule_of(study: Study) -> list[list[Planned]]:
    """For each participant the trials in their order: condition by condition; in each, trainings first, then the repetitions, every one
    of them with all tasks.
    """
    found = []
    for i, row in enumerate(orders(study.order, len(study.conditions), study.participants, study.seed)):
        trials: list[Planned] = []
        for period, c in enumerate(row, 1):
            for repetition in [0] * study.training + list(range(1, study.repetitions + 1)):
                for task in study.tasks:
                    trials.append(Planned(participant_id(i), len(trials) + 1, period, study.conditions[c].name, task.name, repetition))
        found.append(trials)
    return found


def simulate_one(study: Study, folder: Folder, planned: Planned) -> None:
    """A trial of a simulated participant, whose nature follows from the study's seed and the participant's number, so that a trial does
    not depend on which were run before it.
    """
    folder.has_room()
    number = int(planned.participant[1:])
    person = Person.draw(np.random.default_rng([study.seed, number]))
    rng = np.random.default_rng([study.seed, number, planned.number])
    condition = next(each for each in study.conditions if each.name == planned.condition)
    task = next(each for each in study.tasks if each.name == planned.task)
    trial = run_trial(study.robot, condition, task, person, rng, study.rate)
    rows = measure(task, trial.reached, trial, STEP)
    if condition.profile == ONE_INSTANT_IK:
        rows = [row for row in rows if row.measure != "collisions_prevented"]  # it looks for none
    folder.write_trial(planned, condition, rows, to_mcap(trial, planned, condition, study))


def _simulate_participant(path: str, number: int, out: str, index: int) -> None:
    study = load_study(path, number)
    folder = Folder(Path(out))
    for planned in _simulated(schedule_of(study)[index]):
        if not folder.finished(planned):
            simulate_one(study, folder, planned)


def _simulated(trials: list[Planned]) -> list[Planned]:
    """Without trainings: simulated operators know the machine, and learn nothing more."""
    return [each for each in trials if each.repetition > 0]


def simulate(study: Study, out: Path, jobs: int, say: Callable[[str], None] = print) -> None:
    """Every trial that is not finished yet. jobs: processes."""
    folder = Folder(out)
    folder.hold()
    schedule = [_simulated(trials) for trials in schedule_of(study)]
    folder.begin(study, schedule, simulated=True)
    left = [i for i, trials in enumerate(schedule)
            if not folder.deleted(participant_id(i)) and not all(folder.finished(each) for each in trials)]  # fmt: skip
    total, finished = sum(map(len, schedule)), sum(folder.finished(each) for trials in schedule for each in trials)
    say(f"{study.title}: {study.participants} simulated participants, {len(study.conditions)} conditions, {total} trials"
        + (f", {finished} of them are finished already" if finished else ""))  # fmt: skip
    arguments = [(str(study.path), study.participants, str(out), i) for i in left]
    if jobs == 1:
        for n, each in enumerate(arguments, 1):
            _simulate_participant(*each)
            _progress(n, len(arguments))
        return
    with ProcessPoolExecutor(jobs) as pool:
        for n, _ in enumerate(pool.map(_simulate_participant, *zip(*arguments)) if arguments else [], 1):
            _progress(n, len(arguments))


def _progress(n: int, of: int) -> None:
    if sys.stderr.isatty():
        sys.stderr.write(f"\r\033[K{n} of {of} participants" + ("\n" if n == of else ""))


__all__ = ["StudyError", "participant_id", "schedule_of", "simulate", "simulate_one"]
