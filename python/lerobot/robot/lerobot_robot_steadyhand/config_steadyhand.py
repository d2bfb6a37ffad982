"""What `--robot.NAME` sets."""

from dataclasses import dataclass, field

from lerobot.cameras import CameraConfig
from lerobot.robots.config import RobotConfig


@RobotConfig.register_subclass("steadyhand")
@dataclass(kw_only=True)
class SteadyhandRobotConfig(RobotConfig):
    """port: of the page of `steadyhand demo`. robot: that one's, whose joints are observed. gripper: it has one.
    fps: of LeRobot's loop. turn: the policy takes the arm, if nobody has it, and its turn; else a person gives it at the page.
    """

    port: int = 8642
    robot: str = "ur5e"
    gripper: bool = False
    fps: float = 30.0
    turn: bool = False
    cameras: dict[str, CameraConfig] = field(default_factory=dict)
