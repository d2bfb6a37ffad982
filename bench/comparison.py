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
    ratio: float | None  # mean time of the paper's stack over this one's; None without it


def compare(answers, verdicts, paper):
    """`answers` and `verdicts`: solver -> list over the same problems. One row for each solver, in that order."""
    objective = {
        name: np.array([v.objective if v.violation <= FEASIBLE else np.inf for v in vs])
        for name, vs in verdicts.items()
    }
    best = np.min(list(objective.values()), axis=0)
    band = SAME * np.maximum(best, FLOOR)
    paper_time = np.mean([a.time_us for a in answers[paper]]) if paper in answers else None
    rows = []
    for name in answers:
        same = objective[name] <= best + band
        error = np.array([v.error for v in verdicts[name]])
        minimum = ~same & np.isfinite(objective[name]) & (error <= OPTIMAL)
        reference = objective.get(paper, np.full(len(best), np.nan))
        time_ms = np.array([a.time_us for a in answers[name]]) / 1e3
        iterations = [a.iterations for a in answers[name]]
        rows.append(
            Row(
                name,
                len(best),
                sum(a.solved for a in answers[name]),
                int(same.sum()),
                int(minimum.sum()),
                int((~same & ~minimum).sum()),
                int((objective[name] < reference - SAME * np.maximum(reference, FLOOR)).sum()),
                int((objective[name] > reference + SAME * np.maximum(reference, FLOOR)).sum()),
                max(v.violation for v in verdicts[name]),
                float(np.median(error)),
                float(error.max()),
                float(np.mean(iterations)),
                int(max(iterations)),
                float(time_ms.mean()),
                *(float(v) for v in np.percentile(time_ms, [50, 99])),
                float(time_ms.max()),
                float(paper_time / 1e3 / time_ms.mean()) if paper_time else None,
            )
        )
    return rows


COLUMNS = (  # heading, width, value of a Row as text
    ("solved", 8, lambda r: r.solved),
    ("best", 6, lambda r: r.same),
    ("other", 7, lambda r: r.other_minimum),
    ("short", 7, lambda r: r.short),
    ("below", 7, lambda r: r.below_paper),
    ("above", 7, lambda r: r.above_paper),
    ("violation", 11, lambda r: f"{r.violation:.1e}"),
    ("KKT p50", 9, lambda r: f"{r.kkt_median:.0e}"),
    ("KKT max", 9, lambda r: f"{r.kkt:.0e}"),
    ("iterations", 12, lambda r: f"{r.iterations:.1f} ({r.iterations_max})"),
    ("mean", 9, lambda r: f"{r.mean_ms:.2f}"),
    ("p50", 8, lambda r: f"{r.p50_ms:.2f}"),
    ("p99", 8, lambda r: f"{r.p99_ms:.2f}"),
    ("max", 8, lambda r: f"{r.max_ms:.2f}"),
    ("ratio", 8, lambda r: "-" if r.ratio is None else f"{r.ratio:.2f}"),
)

LEGEND = f"""\
best   objective equal to the best known of all solvers (relative {SAME:.0e})
other  a different local minimum, higher           short  neither: not converged, or infeasible
below, above  objective against the paper's stack (casadi) on the same problem
KKT    one measure for all solvers, see bench/kkt.py
iterations  mean (most)    times in ms    ratio  mean time of the paper's stack / mean time"""


def table(rows):
    lines = [f"{'solver':<20}" + "".join(f"{heading:>{width}}" for heading, width, _ in COLUMNS)]
    lines += [f"{row.solver:<20}" + "".join(f"{text(row):>{width}}" for _, width, text in COLUMNS) for row in rows]
    return "\n".join(lines)


def finite(value):
    """JSON has no infinity: what could not be judged becomes null."""
    return value if not isinstance(value, float) or np.isfinite(value) else None


def as_json(rows, answers, verdicts):
    return {
        "solvers": [{key: finite(value) for key, value in asdict(row).items()} for row in rows],
        "problems": {
            name: [
                {
                    "objective": finite(v.objective),
                    "violation": finite(v.violation),
                    "kkt_error": finite(float(v.error)),
                    "iterations": a.iterations,
                    "time_us": a.time_us,
                    "status": a.status,
                }
                for a, v in zip(answers[name], verdicts[name])
            ]
            for name in answers
        },
    }
