"""NASA-TLX (Hart & Staveland 1988), raw and weighted; the System Usability Scale (Brooke 1996); Likert items of a study's own."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Likert:
    name: str
    statement: str
    points: int = 7
    """1: strongly disagree, to so many: strongly agree."""


@dataclass(frozen=True)
class Item:
    """A question of a form. key: under which the answer is kept. An answer is a whole number from low to high."""

    key: str
    text: str
    low: int
    high: int
    low_text: str
    high_text: str


TLX_SCALES = {
    "mental": ("Mental demand: how mentally demanding was the task?", "very low", "very high"),
    "physical": ("Physical demand: how physically demanding was the task?", "very low", "very high"),
    "temporal": ("Temporal demand: how hurried or rushed was the pace of the task?", "very low", "very high"),
    "performance": ("Performance: how successful were you in doing what you were asked to do?", "perfect", "failure"),
    "effort": ("Effort: how hard did you have to work to reach your level of performance?", "very low", "very high"),
    "frustration": ("Frustration: how insecure, discouraged, irritated, stressed and annoyed were you?", "very low", "very high"),
}
TLX_PAIRS = tuple(itertools.combinations(TLX_SCALES, 2))
"""Fifteen, of which the operator says which one counted more; once, at the end."""

SUS_ITEMS = (
    "I think that I would like to use this system frequently.",
    "I found the system unnecessarily complex.",
    "I thought the system was easy to use.",
    "I think that I would need the support of a technical person to be able to use this system.",
    "I found the various functions in this system were well integrated.",
    "I thought there was too much inconsistency in this system.",
    "I would imagine that most people would learn to use this system very quickly.",
    "I found the system very cumbersome to use.",
    "I felt very confident using the system.",
    "I needed to learn a lot of things before I could get going with this system.",
)

QUESTIONNAIRES = ("nasa-tlx", "nasa-tlx-weighted", "sus")


def items_of(questionnaires: Sequence[str], likert: Sequence[Likert]) -> list[Item]:
    """What is asked after each condition."""
    found = []
    if "nasa-tlx" in questionnaires or "nasa-tlx-weighted" in questionnaires:
        found += [Item(f"tlx_{key}", text, 0, 20, low, high) for key, (text, low, high) in TLX_SCALES.items()]
    if "sus" in questionnaires:
        found += [Item(f"sus_{i + 1}", text, 1, 5, "strongly disagree", "strongly agree") for i, text in enumerate(SUS_ITEMS)]
    found += [Item(f"likert_{each.name}", each.statement, 1, each.points, "strongly disagree", "strongly agree") for each in likert]
    return found


def pair_items() -> list[Item]:
    """The fifteen comparisons of the weighted NASA-TLX: 0, the first counted more; 1, the second."""
    return [Item(f"pair_{a}_{b}", "Which contributed more to the workload?", 0, 1, a, b) for a, b in TLX_PAIRS]


def tlx_weights(answers: Mapping[str, int]) -> dict[str, int]:
    """How often each scale was chosen, of 15. answers: of pair_items(). Raises ValueError where one is missing or not 0 or 1."""
    weights = dict.fromkeys(TLX_SCALES, 0)
    for a, b in TLX_PAIRS:
        answer = answers.get(f"pair_{a}_{b}")
        if answer not in (0, 1):
            raise ValueError(f"the comparison of {a} and {b} is {answer!r}; it must be 0, the first, or 1, the second")
        weights[b if answer else a] += 1
    return weights


def tlx_score(answers: Mapping[str, int], weights: Mapping[str, int] | None = None) -> float:
    """0 to 100: raw, the scales' mean; with weights, weighted by them. answers: tlx_* from 0 to 20."""
    total = sum((weights[key] if weights else 1) * 5.0 * answers[f"tlx_{key}"] for key in TLX_SCALES)
    return total / (sum(weights.values()) if weights else len(TLX_SCALES))


def sus_score(answers: Mapping[str, int]) -> float:
    """0 to 100. answers: sus_1 to sus_10 from 1 to 5; even items are worded negatively."""
    return 2.5 * sum(answers[f"sus_{i}"] - 1 if i % 2 else 5 - answers[f"sus_{i}"] for i in range(1, 11))
