"""Keyword arguments that change a profile's settings, checked as far as their type goes."""

from collections.abc import Mapping
from typing import Any

from numpy.typing import ArrayLike

from . import _native
from ._arrays import array, number, text

Weights = Mapping[str, ArrayLike]


def weights_of(weights: Weights) -> dict[str, list[float]]:
    if not isinstance(weights, Mapping):
        raise TypeError(f"weights must be a dict from names of terms to numbers, not {type(weights).__name__}")
    return {text("the name of a term", name): array(f"weights[{name!r}]", value, (), ("n",)).reshape(-1).tolist() for name, value in weights.items()}


def options(**given: Any) -> dict[str, Any]:
    """Those that are not None."""
    result: dict[str, Any] = {}
    for key, value in given.items():
        if value is None:
            continue
        if key == "weights":
            result[key] = weights_of(value)
        elif key == "horizon":
            whole = number(key, value)
            if whole != int(whole):
                raise ValueError(f"horizon is {value}; it must be a whole number")
            if not 1 <= whole <= 128:
                raise _native.SteadyhandError(f"horizon is {whole:.12g}; it must be from 1 to 128")
            result[key] = int(whole)
        elif key in ("solver", "translation_frame", "rotation_frame"):
            result[key] = text(key, value)
        elif key == "glass":
            result[key] = value
        elif key == "accept_emulated":
            result[key] = bool(value)
        else:
            result[key] = number(key, value)
    return result
