"""The container that the tool carries."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ._arrays import number


class Glass(NamedTuple):
    """An upright glass, partly filled: a cylinder, or another container by the radius of its surface and a frequency of its own
    (docs/reference/profiles.md).
    """

    radius: float = 0.035
    """m, inside, of the liquid's surface."""
    height: float = 0.1
    """m, inside."""
    fill: float = 0.09
    """m of liquid."""
    viscosity: float = 1e-6
    """m^2/s, kinematic; water's."""
    frequency_factor: float = 1.0
    """Of the first sloshing mode, over that of a cylinder of this radius and fill."""


GlassLike = Glass | Sequence[float]


def glass_of(glass: GlassLike | None) -> tuple[float, ...] | None:
    """Its numbers."""
    if glass is None:
        return None
    names = Glass._fields
    if isinstance(glass, str) or not hasattr(glass, "__len__"):
        raise TypeError(f"glass must be a steadyhand.Glass, not {type(glass).__name__}")
    if len(glass) != len(names):
        raise ValueError(f"glass has {len(glass)} numbers; it needs {', '.join(names[:-1])} and {names[-1]}")
    return tuple(number(f"glass.{name}", value) for name, value in zip(names, glass))
