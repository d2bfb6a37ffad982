"""Orders of conditions, so that none profits from when it comes."""

from __future__ import annotations

import numpy as np


def balanced_latin_square(n: int) -> list[list[int]]:
    """Orders of n conditions in which each stands as often at each place, and follows each other one as often (Williams 1949): n
    orders where n is even, 2 n where it is odd.
    """
    first = [0]
    for k in range(1, n):
        first.append((k + 1) // 2 if k % 2 else n - k // 2)
    rows = [[(place + shift) % n for place in first] for shift in range(n)]
    return rows if n % 2 == 0 else rows + [row[::-1] for row in rows]


def rows_of(n: int) -> int:
    """How many participants a balanced order of n conditions takes, or a multiple of it."""
    return 1 if n == 1 else n if n % 2 == 0 else 2 * n


def orders(kind: str, conditions: int, participants: int, seed: int) -> list[list[int]]:
    """The conditions' indices in each participant's order. kind: "balanced", whose rows are dealt out in an order drawn from the seed, or
    "random": each participant's own.
    """
    rng = np.random.default_rng([seed, 7])
    if kind == "random":
        return [rng.permutation(conditions).tolist() for _ in range(participants)]
    rows = balanced_latin_square(conditions)
    dealt: list[list[int]] = []
    while len(dealt) < participants:
        dealt += [rows[i] for i in rng.permutation(len(rows))]
    return dealt[:participants]
