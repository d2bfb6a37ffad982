"""What callers hand in, as arrays of the shape that is expected, or the reason why not."""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Shape = tuple[int | str, ...]
"""Letters mean any length."""


def array(name: str, value: ArrayLike, *shapes: Shape, what: str = "") -> Array:
    """C-contiguous float64 of one of the shapes, all finite."""
    if np.ma.is_masked(value):
        raise ValueError(f"{name} has masked entries; {_expected(shapes, what)} without")
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
        raise ValueError(f"{name} has numbers that are not finite: {_not_finite(result)}")
    return result


def number(name: str, value: Any, unit: str = "") -> float:
    """A finite number."""
    try:
        result = float(value)
    except (TypeError, ValueError):
        result = math.nan
    except OverflowError:
        result = math.inf
    if isinstance(value, (str, bytes)) or (math.isnan(result) and not isinstance(value, (float, np.floating))):
        raise TypeError(f"{name} must be a number{unit and ' of ' + unit}, not {_kind(value)}")
    if not math.isfinite(result):
        raise ValueError(f"{name} is {result}; it must be finite")
    return result


def flag(name: str, value: Any) -> bool:
    """True or False."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if not isinstance(value, (bool, int, float, np.bool_, np.number)) or value not in (0, 1):
        raise TypeError(f"{name} must be True or False, not {_kind(value)}")
    return bool(value)


def flags(name: str, value: ArrayLike, length: int, what: str) -> NDArray[np.bool_]:
    """As many of them, also as 0 and 1."""
    result = np.asarray(value)
    if result.dtype != np.bool_:
        numbers = array(name, value, (length,), what=what)
        if not np.isin(numbers, (0.0, 1.0)).all():
            raise ValueError(f"{name} must be of True and False, or 1 and 0")
        result = numbers != 0.0
    if result.shape != (length,):
        raise ValueError(f"{name} has shape {_text(result.shape)}; {_expected(((length,),), what)}")
    return result


def text(name: str, value: Any) -> str:
    """A str that the library can take."""
    if not isinstance(value, str):
        raise TypeError(f"{name} must be text, not {_kind(value)}")
    if "\0" in value or any("\ud800" <= letter <= "\udfff" for letter in value):
        raise ValueError(f"{name} is {value!a:.100}; it must be Unicode without null characters")
    return value


def _not_finite(values: Array) -> str:
    """All of them where they are few, else the first that is not."""
    if values.size <= 36:
        return str(values.tolist())
    first = tuple(int(i) for i in np.argwhere(~np.isfinite(values))[0])
    return f"[{', '.join(map(str, first))}] is {values[first]}"


def _fits(shape: tuple[int, ...], expected: Shape) -> bool:
    return len(shape) == len(expected) and all(isinstance(n, str) or n == m for m, n in zip(shape, expected))


def _text(shape: Shape) -> str:
    return f"({shape[0]},)" if len(shape) == 1 else f"({', '.join(map(str, shape))})"


def _expected(shapes: tuple[Shape, ...], what: str) -> str:
    return "expected " + " or ".join(map(_text, shapes)) + (what and f", {what}")


def _kind(value: Any) -> str:
    return f"{value!a:.60}" if isinstance(value, (str, bytes, bool, int, float)) or value is None else type(value).__name__
