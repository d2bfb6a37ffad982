"""Teleoperation of a robot arm by model predictive control: within joint limits, without collisions or spilled liquid.

Poses are 4x4 matrices of float64: T_a_b maps coordinates in frame b to those in frame a. Quaternions are called quat_xyzw and
have the order x, y, z, w. Units: m, rad, s. Frames: base is the URDF's base link, z up; tool is the tool frame (TCP), with z
out of the opening of a glass. docs/how-to/use-the-library.md has examples.
"""

from . import _places  # noqa: F401  before anything looks for a robot
from ._native import SteadyhandError, processor, solvers
from ._native import version as __version__
from ._cell import Cell, Object
from ._glass import Glass
from ._objective import Node, Objective
from ._planner import Pipeline, Plan, Planner
from ._poses import pose, quat_xyzw
from ._replay import Change, Commands, Hand, Loss, Replay, Session, Setting, States, Steps, read_recording, read_session, replay
from ._robot import Robot
from ._solve import Solution, solve
from ._stages import Liquid, LiquidState, Predictor, Retargeter

SteadyhandError.__module__ = __name__
SteadyhandError.__doc__ = "Invalid input: what was refused and which values are valid, as the program prints it."

__all__ = [
    "Cell", "Change", "Commands", "Glass", "Hand", "Liquid", "LiquidState", "Loss", "Node", "Object", "Objective", "Pipeline", "Plan", "Planner", "Predictor", "Replay", "Retargeter",
    "Robot", "Session", "Setting", "Solution", "States", "SteadyhandError", "Steps", "__version__", "pose", "processor",
    "quat_xyzw", "read_recording", "read_session", "replay", "solve", "solvers",
]  # fmt: skip
