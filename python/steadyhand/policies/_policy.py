"""What a policy sees, and what it says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from .._arrays import Array


@dataclass(frozen=True)
class Observation:
    """One look at a session."""

    t: float
    """s, of the session's clock."""
    state: str
    """What supervision is in: idle, ready, engaged, holding, stopping or fault."""
    reason: str
    """Why, in words."""
    leader: str | None
    """Whose hand the arm follows: person, recording or policy; None: nobody's."""
    q: Array
    """(n,), measured, rad (m)."""
    dq: Array
    """(n,), rad/s (m/s)."""
    command: Array
    """(n,), joints as they are commanded, rad (m)."""
    gripper: float | None
    """0 open to 1 closed, measured; None: the arm has none."""
    gripper_command: float | None
    """What it is told."""
    T_base_tool: Array
    """(4, 4): where the tool is."""
    T_base_target: Array
    """(4, 4): where whoever leads wants it."""
    things: dict[str, Array]
    """By name of what the simulated task looks at, (4, 4): where it is in the base; empty without a task."""


@dataclass(frozen=True)
class Action:
    """Where the tool is to be when the policy's next action is due."""

    T_base_tool: Array
    """(4, 4). What is not finite holds the arm."""
    gripper: float | None = None
    """0 open to 1 closed; None: as it is."""


class Policy(Protocol):
    """Anything with these members."""

    period: float
    """s, from one action to the next: 0.004 to 0.5."""

    def act(self, observation: Observation) -> Action:
        """What to do next."""
        ...
