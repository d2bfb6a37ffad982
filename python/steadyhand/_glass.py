"""The container that the tool carries."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ._arrays import number


class Glass(NamedTuple):
    """An upright, partly filled cylinder. Describe another container by the radius of its liquid's surface and its frequency factor
    (docs/reference/profiles.md).
    """

    radius: float = 0.035
    """m, inner radius at the liquid's surface."""
    height: float = 0.1
    """m, inner height."""
    fill: float = 0.09
    """m, fill level."""
    viscosity: float = 1e-6
    """m^2/s, kinematic viscosity; the default is that of water."""
    frequency_factor: float = 1.0
    """Frequency of the first sloshing mode, divided by that of a cylinder with this radius and fill level."""


GlassLike = Glass | Sequence[float]


def glass_of(glass: GlassLike | None) -> tuple[float, ...] | None:
    """The numbers of a glass."""
    if glass is None:
        return None
    names = Glass._fields
    if isinstance(glass, str) or not hasattr(glass, "__len__"):
        raise TypeError(f"glass must be a steadyhand.Glass, not {type(glass).__name__}")
    if len(glass) != len(names):
        raise ValueError(f"glass has {len(glass)} numbers; it needs {', '.join(names[:-1])} and {names[-1]}")
    return tuple(number(f"glass.{name}", value) for name, value in zip(names, glass))
