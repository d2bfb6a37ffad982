"""steadyhand's arm as a robot of LeRobot: `--robot.type=steadyhand`."""

from .config_steadyhand import SteadyhandRobotConfig
from .steadyhand import SteadyhandRobot

__all__ = ["SteadyhandRobot", "SteadyhandRobotConfig"]
