"""A task in virtual time, in this process: the program's session, planner, checks and supervision, an arm and a scene with contact."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import _native
from .._arrays import array, number, text
from ._policy import Action, Observation, Policy


@dataclass(frozen=True)
class Outcome:
    """Result of a run of a task so far."""

    success: bool | None
    """None: not decided yet."""
    time: float
    """s, since the scene was set up or until it was decided."""
    spilled: float
    """Share of the liquid."""
    forbidden: int
    """Contacts that the task forbids."""
    beyond_limits: int
    """Commands and measured speeds beyond a limit."""
    over: bool
    """Done, out of time, or the arm was stopped."""
    reason: str
    """Reason of the session's state, or the failed condition."""


class Simulation:
    """A task of steadyhand (docs/reference/tasks.md) in virtual time, as fast as the machine can. One thread.

    task, robot, profile: name or file; the default robot is that of the task. rate: plans per second, Hz.
    Raises SteadyhandError with the reason for invalid input, and if there is no MuJoCo.
    """

    def __init__(self, task: str, *, profile: str = "tracking", robot: str = "", rate: float = 50.0) -> None:
        if _native.Simulation is None:
            raise _native.SteadyhandError("this build of steadyhand simulates no tasks: it was built without MuJoCo (docs/how-to/policies.md)")
        self._native = _native.Simulation(text("task", task), text("robot", robot), text("profile", profile), number("rate", rate, "Hz"))
        self._began = False

    def begin(self, seed: int) -> Observation:
        """Sets the scene up with this seed (0 or more); the arm is ready, and not engaged."""
        self._native.begin(int(seed))
        self._began = True
        return self.observe()

    def _running(self) -> Any:
        if not self._began:
            raise ValueError("nothing runs yet; begin(seed) first")
        return self._native

    def observe(self) -> Observation:
        """The current observation."""
        return Observation(**self._running().observe())

    def advance(self, seconds: float) -> Observation:
        """Advances time by this many seconds, or until the run is over."""
        self._running().advance(number("seconds", seconds, "s"))
        return self.observe()

    @property
    def outcome(self) -> Outcome:
        """The result so far."""
        return Outcome(**self._running().outcome())

    @property
    def instruction(self) -> str:
        """The task in words."""
        return str(self._native.instruction)

    # ---- a policy
    def connect(self, name: str, period: float) -> None:
        """Connects a policy. period: s, from one target to the next."""
        self._running().connect(text("name", name), number("period", period, "s"))

    def disconnect(self) -> None:
        """Disconnects the policy."""
        self._running().disconnect()

    def turn(self, on: bool = True) -> None:
        """Gives the policy its turn, or ends it, as a person does. Refused while the arm is stopped or a person is engaged."""
        self._running().turn(bool(on))

    @property
    def policy_turn(self) -> bool:
        """Whether the policy has its turn: it controls the arm while no person is engaged."""
        return bool(self._running().policy_turn)

    def target(self, action: Action) -> None:
        """Sends the policy's target."""
        T = np.ascontiguousarray(action.T_base_tool, dtype=np.float64)
        if T.shape != (4, 4):
            raise ValueError(f"T_base_tool has shape {T.shape}; it must be (4, 4)")
        self._running().target(T, None if action.gripper is None else float(action.gripper))

    def run(self, policy: Policy, seconds: float | None = None) -> Outcome:
        """Runs the policy, in its turn, until the run is over or for this many seconds."""
        if not self.policy_turn:
            self.connect(type(policy).__name__, policy.period)
            self.turn()
        end = np.inf if seconds is None else self.observe().t + seconds
        while not (outcome := self.outcome).over and (seen := self.observe()).t < end:
            self.target(policy.act(seen))
            self.advance(policy.period)
        return outcome

    # ---- a person
    def hold(self, T_base_hand: ArrayLike, gripper: float | None = None) -> None:
        """Engages a person's hand at this pose; from now on the tool follows its motion."""
        self._running().hold(array("T_base_hand", T_base_hand, (4, 4)), gripper)

    def operate(self, in_the_middle: bool = False) -> None:
        """The task's scripted operator is the person from now on. in_the_middle: it continues from the current state of the task."""
        self._running().operate(bool(in_the_middle))

    @property
    def operating(self) -> bool:
        """Whether the scripted operator has moves left."""
        return bool(self._running().operating)

    def let_go(self) -> None:
        """Releases the person's hand."""
        self._running().let_go()

    def stop(self) -> None:
        """Stops the arm."""
        self._running().stop()

    def reset(self) -> None:
        """Resets the stop; refused until the arm is stationary."""
        self._running().reset()
