"""Observations and actions of a policy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from .._arrays import Array


@dataclass(frozen=True)
class Observation:
    """The state of a session at one time. Of robots with two tools, values of a tool are two: T_base_tool is (2, 4, 4), and gripper
    a tuple."""

    t: float
    """s, of the session's clock."""
    state: str
    """State of supervision: idle, ready, engaged, holding, stopping or fault."""
    reason: str
    """Reason of the state, in words."""
    leader: str | None
    """Source of the hand that the arm follows: person, recording or policy; None: the arm is not engaged."""
    q: Array
    """(n,), measured joint positions, rad (m)."""
    dq: Array
    """(n,), measured joint velocities, rad/s (m/s)."""
    command: Array
    """(n,), commanded joint positions, rad (m)."""
    gripper: float | None | tuple[float | None, ...]
    """0 open to 1 closed, measured; None: the arm has none."""
    gripper_command: float | None | tuple[float | None, ...]
    """0 open to 1 closed, commanded; None: the arm has none."""
    T_base_tool: Array
    """(4, 4): measured pose of the tool frame in the base."""
    T_base_target: Array
    """(4, 4): target of the tool frame in the base."""
    things: dict[str, Array]
    """(4, 4): pose in the base of each thing of the simulated task, by name; empty without a task."""


@dataclass(frozen=True)
class Action:
    """Target of the tool for the time when the policy's next action is due."""

    T_base_tool: Array
    """(4, 4), in the base; robots with two tools: (2, 4, 4). The arm holds if a number is not finite."""
    gripper: float | None | tuple[float | None, ...] = None
    """0 open to 1 closed; None: unchanged. Robots with two tools: one for each."""


class Policy(Protocol):
    """Anything with these members."""

    period: float
    """s, from one action to the next: 0.004 to 0.5."""

    def act(self, observation: Observation) -> Action:
        """The next action, for the newest observation."""
        ...
