"""What `--teleop.NAME` sets."""

from dataclasses import dataclass

from lerobot.teleoperators.config import TeleoperatorConfig


@TeleoperatorConfig.register_subclass("steadyhand")
@dataclass(kw_only=True)
class SteadyhandTeleoperatorConfig(TeleoperatorConfig):
    """port: of the page of `steadyhand demo`. robot: that one's, whose tools the hands move. gripper: each has one."""

    port: int = 8642
    robot: str = "ur5e"
    gripper: bool = False
