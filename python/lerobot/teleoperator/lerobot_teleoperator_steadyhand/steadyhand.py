"""The hand at steadyhand's page, in a headset or at a gamepad, as LeRobot's loops see it."""

from functools import cached_property
from typing import Any

import steadyhand
from lerobot.teleoperators.teleoperator import Teleoperator
from lerobot.teleoperators.utils import TeleopEvents
from steadyhand.policies import Link

from .config_steadyhand import SteadyhandTeleoperatorConfig

POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")


class SteadyhandTeleoperator(Teleoperator):
    """An action is where the hand wants the tool, in the base, x, y, z in m and quaternion; without a grip, where the tool is.
    With two tools, names of their values begin with the tool's, as those of LeRobot's bi_* robots: left_tool.x, left_gripper.pos.

    The hand leads the arm by itself, through steadyhand; LeRobot sends the action on to the robot, where it does nothing then.
    """

    config_class = SteadyhandTeleoperatorConfig
    name = "steadyhand"

    def __init__(self, config: SteadyhandTeleoperatorConfig) -> None:
        super().__init__(config)
        self.config = config
        robot = steadyhand.Robot(config.robot)
        self._tools = [""] if robot.tool_count == 1 else [f"{name}_" for name in robot.tool_names]
        self._link: Link | None = None

    @cached_property
    def action_features(self) -> dict[str, type]:
        grippers = {f"{of}gripper.pos": float for of in self._tools if self.config.gripper}
        return {f"{of}tool.{name}": float for of in self._tools for name in POSE} | grippers

    @property
    def feedback_features(self) -> dict[str, type]:
        return {}

    @property
    def is_connected(self) -> bool:
        return self._link is not None and self._link.alive

    def connect(self, calibrate: bool = True) -> None:
        self._link = Link(self.config.port)

    @property
    def is_calibrated(self) -> bool:
        return True

    def calibrate(self) -> None:
        """Every grip begins from where hand and tool are."""

    def configure(self) -> None:
        """All is set at steadyhand's page."""

    def _linked(self) -> Link:
        if self._link is None:
            raise ConnectionError(f"{self} is not connected")
        return self._link

    def get_action(self) -> dict[str, float]:
        seen = self._linked().observe()
        targets = seen.T_base_target.reshape(-1, 4, 4)
        if len(targets) != len(self._tools):
            raise ValueError(f"the robot that steadyhand leads has {len(targets)} tools; --teleop.robot is {self.config.robot}, with {len(self._tools)}")
        values = [number for T in targets for number in (*T[:3, 3], *steadyhand.quat_xyzw(T))]
        if self.config.gripper:
            grippers = seen.gripper_command if isinstance(seen.gripper_command, tuple) else (seen.gripper_command,)
            if None in grippers:
                raise ValueError("the arm has no gripper; leave out --teleop.gripper")
            values += grippers
        return {name: float(value) for name, value in zip(self.action_features, values)}

    def get_teleop_events(self) -> dict[str, Any]:
        """Of LeRobot's loops with a policy: whether the person leads in its turn."""
        state = self._linked().state
        intervention = self._linked().observe().leader == "person" and bool(state["controls"]["policy_turn"])
        return {
            TeleopEvents.IS_INTERVENTION: intervention, TeleopEvents.TERMINATE_EPISODE: False,
            TeleopEvents.SUCCESS: bool((state["task"] or {}).get("success")), TeleopEvents.RERECORD_EPISODE: False,
        }  # fmt: skip

    def send_feedback(self, feedback: dict[str, float]) -> None:
        """It takes none."""

    def disconnect(self) -> None:
        if self._link is not None:
            self._link.close()
            self._link = None
