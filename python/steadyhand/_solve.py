"""Single optimal control problems."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from . import _native
from ._arrays import Array, text
from ._documented import document


@dataclass(frozen=True)
class Solution:
    """Solution of one optimal control problem with N intervals and n joints."""

    status: str
    """"solved", "feasible", "infeasible" or "invalid" (docs/explanation/formulation.md)."""
    objective: float
    """Cost J."""
    iterations: int
    time_us: float
    """us, wall time."""
    kkt_error: float
    """Largest violation of the KKT conditions, unscaled."""
    x: Array
    """(N + 1, 2n): states [q; dq], rad (m), rad/s (m/s)."""
    u: Array
    """(N, n): accelerations, rad/s^2 (m/s^2)."""


def _plain(value: Any) -> Any:
    """The value in types of JSON. Numbers that are not finite become text, so the reader refuses them with their place."""
    if isinstance(value, Mapping):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return os.fspath(value) if isinstance(value, os.PathLike) else value


def _solution(answer: dict[str, Any]) -> Solution:
    for key in ("x", "u"):
        answer[key] = np.array([[math.nan if v is None else v for v in row] for row in answer[key]], dtype=np.float64)
    for key in ("objective", "kkt_error"):
        answer[key] = math.nan if answer[key] is None else answer[key]
    return Solution(**answer)


def solve(problem: Any, solver: str | None = None) -> Any:
    """Solves one problem, or a list of problems in order, like the command `steadyhand solve`.

    problem: a dict with the keys of docs/explanation/formulation.md (robot, dt, horizon, x0, weights, reference; optional: guess,
    tolerance and others), with lists or numpy arrays; a list of such dicts; or the path of a JSON file with either.
    solver: one of steadyhand.solvers.

    Returns a Solution, or a list of Solutions. Python's lock is released during the solve. Raises SteadyhandError (a ValueError)
    for missing or unknown keys, wrong sizes, numbers that are not finite, references that are not rotations, and unknown robots,
    terms and solvers; FileNotFoundError for a path that does not exist.
    """
    name = ""
    chosen = _native.default_solver if solver is None else text("solver", solver)
    if isinstance(problem, (str, os.PathLike)):
        name = text("the name of the problem", os.fspath(problem))
        if not Path(problem).is_file():
            raise FileNotFoundError(f"{name}: cannot be read")
        problems = Path(problem).read_text(errors="replace")
    elif isinstance(problem, (Mapping, list, tuple)):
        try:
            problems = json.dumps(_plain(problem))
        except TypeError as error:
            raise TypeError(f"problem: {error}") from None
    else:
        raise TypeError(f"problem must be a dict, a list of them or the path of a JSON file, not {type(problem).__name__}")
    answer = json.loads(_native.solve(problems, name, chosen))
    return [_solution(each) for each in answer] if isinstance(answer, list) else _solution(answer)


document(globals())
