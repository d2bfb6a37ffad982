"""Statistics held to the truth: data sets drawn from a model of trials whose effects are known, analysed as a study is."""

import math
from typing import NamedTuple

import numpy as np

from steadyhand.study.order import orders
from steadyhand.study.statistics import effect_size, friedman, mean, mixed_model, pairs, power


class World(NamedTuple):
    """Logarithms of completion times: participant + condition + participant x condition + practice + trial."""

    participants: int = 24
    conditions: int = 4
    trials: int = 3
    effect: float = 0.1
    """Of condition 1 on the logarithm, that is 10 %; the others have none."""
    between: float = 0.2
    """Standard deviation of participants."""
    own: float = 0.1
    """Of participant x condition."""
    trial: float = 0.2
    """Of trials."""
    practice: float = -0.02
    """For each place in the order."""

    @property
    def error(self) -> float:
        """Standard deviation of a participant's mean in a condition about the additive model."""
        return math.sqrt(self.own**2 + self.trial**2 / self.trials)

    @property
    def dz(self) -> float:
        return self.effect / (math.sqrt(2.0) * self.error)


def draw(world: World, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """values, periods: (participants, conditions)."""
    rng = np.random.default_rng([seed, 21])
    n, k = world.participants, world.conditions
    periods = np.empty((n, k))
    for i, row in enumerate(orders("balanced", k, n, seed)):
        periods[i, row] = np.arange(k)
    beta = np.zeros(k)
    beta[1] = world.effect
    y = rng.normal(0.0, world.between, (n, 1)) + beta + rng.normal(0.0, world.own, (n, k)) + world.practice * periods
    y = y + rng.normal(0.0, world.trial, (n, k, world.trials)).mean(axis=2)
    return y, periods


class Verdict(NamedTuple):
    data_sets: int
    coverage_model: float
    coverage_difference: float
    coverage_effect_size: float
    power_model: float
    power_model_said: float
    power_pair: float
    power_pair_said: float
    false_model: float
    false_friedman: float
    false_pairs: float
    """Any of the Holm-corrected pairs, where no condition differs."""


def judge(data_sets: int, world: World = World(), seed: int = 1) -> Verdict:
    """With the effect, and the same without it."""
    names = [f"c{i}" for i in range(world.conditions)]
    n, k = world.participants, world.conditions
    hits = dict.fromkeys(("model", "difference", "dz", "found", "paired"), 0)
    false = dict.fromkeys(("model", "friedman", "pairs"), 0)
    for i in range(data_sets):
        y, periods = draw(world, 2 * (seed * 1_000_003 + i))
        contrast = mixed_model(y, names, "c0", periods)[0]
        hits["model"] += contrast.difference.low <= world.effect <= contrast.difference.high
        hits["found"] += contrast.p < 0.05
        d = y[:, 1] - y[:, 0]
        difference, size = mean(d), effect_size(d)
        hits["difference"] += difference.low <= world.effect <= difference.high
        hits["paired"] += not difference.low <= 0.0 <= difference.high
        # Practice adds to what a pair's differences scatter by.
        hits["dz"] += size.low <= world.effect / _scatter(world) <= size.high
        y, periods = draw(world._replace(effect=0.0), 2 * (seed * 1_000_003 + i) + 1)
        false["model"] += mixed_model(y, names, "c0", periods)[0].p < 0.05
        omnibus = friedman(y)
        false["friedman"] += omnibus is not None and omnibus.p < 0.05
        false["pairs"] += any(pair.p_holm < 0.05 for pair in pairs(y, names))
    df = n * k - n - k
    return Verdict(
        data_sets, hits["model"] / data_sets, hits["difference"] / data_sets, hits["dz"] / data_sets, hits["found"] / data_sets,
        power(world.dz, n, df), hits["paired"] / data_sets, power(world.effect / _scatter(world), n), false["model"] / data_sets,
        false["friedman"] / data_sets, false["pairs"] / data_sets,
    )  # fmt: skip


def _scatter(world: World) -> float:
    """Standard deviation of the difference of two conditions, with practice: two places of the order, drawn without repetition."""
    k = world.conditions
    places = 2.0 * (k * k - 1) / 12.0 * k / (k - 1)
    return math.sqrt(2.0 * world.error**2 + world.practice**2 * places)
