"""From every solver's answers to one profile's problems to the figures and the table."""

from dataclasses import asdict, dataclass

import numpy as np

SAME = 1e-6  # relative; objectives below FLOOR (an error of 2 mm all along) are compared as if they were FLOOR
FLOOR = 1e-3
FEASIBLE = 1e-6  # largest violation of an answer that may set the best known objective
OPTIMAL = 1e-5  # largest KKT error of what counts as a minimum


@dataclass
class Row:
    """One solver on one profile. `same`, `other_minimum` and `short` add up to the problems."""

    solver: str
    problems: int
    solved: int  # by the solver's own word
    same: int  # objective within SAME of the best known
    other_minimum: int  # above it, but feasible and a minimum: KKT error below OPTIMAL
    short: int  # neither
    below_paper: int  # objective lower than the paper's stack by more than SAME, and feasible
    above_paper: int
    violation: float  # largest
    kkt_median: float
    kkt: float  # largest
    iterations: float  # mean
    iterations_max: int
    mean_ms: float
    p50_ms: float
    p99_ms: float
    max_ms: float
    ratio: float  # mean time of the paper's stack over this one's; nan without it


def compare(answers, verdicts, paper):
    """`answers` and `verdicts`: solver -> list over the same problems. Returns the rows in the same order of solvers."""
    objective = {name: np.array([v.objective if v.violation <= FEASIBLE else np.inf for v in vs]) for name, vs in verdicts.items()}
    best = np.min(list(objective.values()), axis=0)
    band = SAME * np.maximum(best, FLOOR)
    paper_time = np.mean([a.time_us for a in answers[paper]]) if paper in answers else np.nan
    rows = []
    for name in answers:
        same = objective[name] <= best + band
        error = np.array([v.error for v in verdicts[name]])
        minimum = ~same & np.isfinite(objective[name]) & (error <= OPTIMAL)
        reference = objective.get(paper, np.full(len(best), np.nan))
        time_ms = np.array([a.time_us for a in answers[name]]) / 1e3
        iterations = [a.iterations for a in answers[name]]
        rows.append(Row(
            name, len(best), sum(a.solved for a in answers[name]), int(same.sum()), int(minimum.sum()), int((~same & ~minimum).sum()),
            int((objective[name] < reference - SAME * np.maximum(reference, FLOOR)).sum()),
            int((objective[name] > reference + SAME * np.maximum(reference, FLOOR)).sum()),
            max(v.violation for v in verdicts[name]), float(np.median(error)), float(error.max()), float(np.mean(iterations)),
            int(max(iterations)), float(time_ms.mean()), *(float(v) for v in np.percentile(time_ms, [50, 99])), float(time_ms.max()),
            float(paper_time / 1e3 / time_ms.mean())))
    return rows


HEADER = (f"{'solver':<12}{'solved':>7}{'best':>6}{'other':>6}{'short':>6}{'below':>7}{'above':>6}{'violation':>11}{'KKT p50':>9}{'KKT max':>9}"
          f"{'iterations':>12}{'mean':>9}{'p50':>8}{'p99':>8}{'max':>8}{'ratio':>8}")

LEGEND = f"""\
best   objective equal to the best known of all solvers (relative {SAME:.0e})      other  a different local minimum, higher
short  neither: not converged or infeasible      below, above  objective against the paper's stack (casadi) on the same problem
KKT    one measure for all solvers, see bench/kkt.py      times in ms      ratio  mean time of the paper's stack / mean time"""


def format_row(r):
    return (f"{r.solver:<12}{r.solved:>7}{r.same:>6}{r.other_minimum:>6}{r.short:>6}{r.below_paper:>7}{r.above_paper:>6}{r.violation:>11.1e}"
            f"{r.kkt_median:>9.0e}{r.kkt:>9.0e}{f'{r.iterations:.1f} ({r.iterations_max})':>12}{r.mean_ms:>9.2f}{r.p50_ms:>8.2f}"
            f"{r.p99_ms:>8.2f}{r.max_ms:>8.2f}{r.ratio:>8.2f}")


def as_json(rows, answers, verdicts):
    return {"solvers": [asdict(row) for row in rows],
            "problems": {name: [{"objective": v.objective, "violation": v.violation, "kkt_error": v.error, "iterations": a.iterations,
                                 "time_us": a.time_us, "status": a.status} for a, v in zip(answers[name], verdicts[name])]
                         for name in answers}}
