"""A robot arm follows a hand: inside its limits, clear of itself, without spilling the glass that it holds."""

from . import _places  # noqa: F401  before anything looks for a robot
from ._native import SteadyhandError, __version__
from .planner import Plan, Planner
from .robot import Robot

__all__ = ["Plan", "Planner", "Robot", "SteadyhandError", "__version__"]
