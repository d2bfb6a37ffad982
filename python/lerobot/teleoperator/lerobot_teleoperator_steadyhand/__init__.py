"""The hand that leads steadyhand as a teleoperator of LeRobot: `--teleop.type=steadyhand`."""

from .config_steadyhand import SteadyhandTeleoperatorConfig
from .steadyhand import SteadyhandTeleoperator

__all__ = ["SteadyhandTeleoperator", "SteadyhandTeleoperatorConfig"]
