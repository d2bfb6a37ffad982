"""What callers hand in, as arrays of the shape that is expected, or the reason why not."""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Shape = tuple[int | str, ...]
"""Letters stand for any length."""


def array(name: str, value: ArrayLike, *shapes: Shape, what: str = "") -> Array:
    """C-contiguous float64 of one of the shapes, all finite."""
    try:
        result = np.asarray(value, order="C")
    except ValueError:
        raise ValueError(f"{name} is no array: its rows differ in length; {_expected(shapes, what)}") from None
    if result.dtype != np.float64:
        if result.dtype.kind not in "iuf":
            raise TypeError(f"{name} must be numbers, not {_kind(value)}; {_expected(shapes, what)}")
        result = result.astype(np.float64)
    if not any(_fits(result.shape, shape) for shape in shapes):
        raise ValueError(f"{name} has shape {_text(result.shape)}; {_expected(shapes, what)}")
    if not np.isfinite(result).all():
        raise ValueError(f"{name} has numbers that are not finite: {result.tolist()}")
    return result


def number(name: str, value: Any, unit: str = "") -> float:
    """A finite number."""
    try:
        result = float(value)
    except (TypeError, ValueError):
        result = math.nan
    if isinstance(value, (str, bytes)) or (math.isnan(result) and not isinstance(value, (float, np.floating))):
        raise TypeError(f"{name} must be a number{unit and ' of ' + unit}, not {_kind(value)}")
    if not math.isfinite(result):
        raise ValueError(f"{name} is {result}; it must be finite")
    return result


def _fits(shape: tuple[int, ...], expected: Shape) -> bool:
    return len(shape) == len(expected) and all(isinstance(n, str) or n == m for m, n in zip(shape, expected))


def _text(shape: Shape) -> str:
    return f"({shape[0]},)" if len(shape) == 1 else f"({', '.join(map(str, shape))})"


def _expected(shapes: tuple[Shape, ...], what: str) -> str:
    return "expected " + " or ".join(map(_text, shapes)) + (what and f", {what}")


def _kind(value: Any) -> str:
    return f"{value!r:.60}" if isinstance(value, (str, bytes, bool)) or value is None else type(value).__name__
