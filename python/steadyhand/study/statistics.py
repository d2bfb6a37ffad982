"""The statistics of a within-subject study: one value of a measure for each participant and condition, its mean over trials.

tests/python/study_truth.py compares them with data whose truth is known: coverage of the intervals, false positives, power.
"""

from __future__ import annotations

import bisect
import itertools
import math
import warnings
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy import optimize, stats

from .._arrays import Array

LEVEL = 0.95


class Estimate(NamedTuple):
    """A number with its 95 % interval."""

    value: float
    low: float
    high: float


class Contrast(NamedTuple):
    """One condition less another."""

    name: str
    reference: str
    difference: Estimate
    df: float
    p: float


class Pair(NamedTuple):
    """A pair of conditions: Wilcoxon's signed ranks, corrected by Holm over all pairs of the measure."""

    a: str
    b: str
    difference: Estimate
    """Difference of the means, a minus b, by Student's t on the participants' differences."""
    dz: Estimate
    """The mean difference over the standard deviation of the differences (Cohen's d_z)."""
    p: float
    n: int
    """Participants that have both."""
    p_holm: float


class Omnibus(NamedTuple):
    statistic: float
    df: int
    p: float


def mean(values: Array, level: float = LEVEL) -> Estimate:
    """With the interval of Student's t."""
    values = np.asarray(values, dtype=float)
    n, m = len(values), float(np.mean(values))
    if n < 2:
        return Estimate(m, float("nan"), float("nan"))
    half = float(stats.t.ppf(0.5 + level / 2, n - 1) * np.std(values, ddof=1) / math.sqrt(n))
    return Estimate(m, m - half, m + half)


def effect_size(differences: Array, level: float = LEVEL) -> Estimate:
    """Cohen's d_z; its interval by inverting the noncentral t (Steiger & Fouladi 1997)."""
    d = np.asarray(differences, dtype=float)
    n, sd = len(d), float(np.std(d, ddof=1)) if len(d) > 1 else 0.0
    if sd == 0.0:
        return Estimate(float("nan"), float("nan"), float("nan"))
    t = float(np.mean(d)) / sd * math.sqrt(n)

    def bound(share: float) -> float:
        reach = abs(t) + 10.0 + abs(t)
        def gap(ncp: float) -> float:
            return float(stats.nct.cdf(t, n - 1, ncp)) - share
        try:
            return float(optimize.brentq(gap, t - reach, t + reach)) / math.sqrt(n)
        except ValueError:
            return float("nan")

    return Estimate(t / math.sqrt(n), bound(0.5 + level / 2), bound(0.5 - level / 2))


def mixed_model(values: Array, conditions: Sequence[str], reference: str, periods: Array | None = None) -> list[Contrast]:
    """A linear mixed model by REML: condition and (linear) period are fixed, participants are random.

    values: (participants, conditions), NaN where there is none. periods: alike, at which place of the order a condition came.
    Each condition less the reference, with Student's t of N - participants - fixed effects + 1 degrees of freedom (between-within):
    the normal distribution, statsmodels' own, is too narrow for some dozens of participants.
    """
    import statsmodels.api as sm

    values = np.asarray(values, dtype=float)
    n, k = values.shape
    who, which = np.nonzero(np.isfinite(values))
    y = values[who, which]
    names = [name for name in conditions if name != reference]
    columns = [np.ones(len(y))] + [(which == list(conditions).index(name)).astype(float) for name in names]
    if periods is not None and k > 1:
        place = np.asarray(periods, dtype=float)[who, which]
        columns.append(place - place.mean())
    X = np.column_stack(columns)
    df = len(y) - n - X.shape[1] + 1
    spread = float(np.std(y))
    if not names or df < 1 or spread == 0.0 or np.linalg.matrix_rank(X) < X.shape[1]:
        return []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # variances at the edge of what they may be, which is an answer
        result = None
        for method in ("lbfgs", "powell"):
            try:
                result = sm.MixedLM(y / spread, X, groups=who).fit(reml=True, method=method)
            except np.linalg.LinAlgError:
                continue
            if result.converged:
                break
    if result is None:
        return []
    half = float(stats.t.ppf(0.5 + LEVEL / 2, df))
    found = []
    for i, name in enumerate(names, 1):
        b, se = float(result.fe_params[i]) * spread, float(result.bse_fe[i]) * spread
        found.append(Contrast(name, reference, Estimate(b, b - half * se, b + half * se), df, float(2 * stats.t.sf(abs(b / se), df))))
    return found


def friedman(values: Array) -> Omnibus | None:
    """Over participants that have every condition; None where that says nothing."""
    full = values[np.isfinite(values).all(axis=1)]
    if full.shape[1] < 3 or len(full) < 3 or np.all(full == full[:, :1]):
        return None
    statistic, p = stats.friedmanchisquare(*full.T)
    return Omnibus(float(statistic), full.shape[1] - 1, float(p))


def holm(p: Sequence[float]) -> list[float]:
    """Adjusted p values (Holm 1979)."""
    from statsmodels.stats.multitest import multipletests

    return multipletests(p, method="holm")[1].tolist() if p else []


def pairs(values: Array, conditions: Sequence[str], chosen: Sequence[tuple[int, int]] | None = None) -> list[Pair]:
    """Compares all pairs of conditions, or the chosen ones."""
    found: list[Any] = []
    for i, j in chosen if chosen is not None else itertools.combinations(range(len(conditions)), 2):
        both = np.isfinite(values[:, i]) & np.isfinite(values[:, j])
        d = values[both, i] - values[both, j]
        if len(d) < 2:
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # ties
            p = float(stats.wilcoxon(d).pvalue) if np.any(d != 0.0) else 1.0
        found.append((conditions[i], conditions[j], mean(d), effect_size(d), p, len(d)))
    return [Pair(*each, adjusted) for each, adjusted in zip(found, holm([each[-2] for each in found]))]


def power(effect: float, participants: int, df: float | None = None, alpha: float = 0.05) -> float:
    """Power of a two-sided t test for a true effect d_z. df: degrees of freedom of the error; default: participants - 1."""
    df = participants - 1 if df is None else df
    t, ncp = stats.t.ppf(1 - alpha / 2, df), min(abs(effect) * math.sqrt(participants), 20.0)  # beyond that it is 1
    other_side = float(stats.nct.cdf(-t, df, ncp)) if ncp < 5.0 else 0.0  # scipy's is no number for large ones
    return float(stats.nct.sf(t, df, ncp)) + other_side


def participants_for(effect: float, wanted: float = 0.8, most: int = 2000) -> int | None:
    """How many find a true effect d_z with this power; None: more than `most`."""
    if not math.isfinite(effect) or effect == 0.0 or power(effect, most) < wanted:
        return None
    return 2 + bisect.bisect_left(range(2, most), wanted, key=lambda n: power(effect, n))


def detectable(participants: int, wanted: float = 0.8) -> float:
    """The d_z that so many find with this power."""
    if participants < 3:
        return float("nan")
    return float(optimize.brentq(lambda d: power(d, participants) - wanted, 1e-3, 15.0 / math.sqrt(participants)))
