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

    The hand leads the arm by itself, through steadyhand; LeRobot sends the action on to the robot, where it does nothing then.
    """

    config_class = SteadyhandTeleoperatorConfig
    name = "steadyhand"

    def __init__(self, config: SteadyhandTeleoperatorConfig) -> None:
        super().__init__(config)
        self.config = config
        self._link: Link | None = None

    @cached_property
    def action_features(self) -> dict[str, type]:
        return {f"tool.{name}": float for name in POSE} | ({"gripper.pos": float} if self.config.gripper else {})

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
        pose = (*seen.T_base_target[:3, 3], *steadyhand.quat_xyzw(seen.T_base_target))
        action = {f"tool.{name}": float(value) for name, value in zip(POSE, pose)}
        if self.config.gripper:
            if seen.gripper_command is None:
                raise ValueError("the arm has no gripper; leave out --teleop.gripper")
            action["gripper.pos"] = float(seen.gripper_command)
        return action

    def get_teleop_events(self) -> dict[str, Any]:
        """Of LeRobot's loops with a policy: whether the person leads in its turn."""
        state = self._linked().state
        intervention = state["leader"] == "person" and bool(state["controls"]["policy_turn"])
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
