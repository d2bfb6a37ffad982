"""A policy of a live session, over the page's protocol (docs/reference/protocol.md)."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from .._page_client import PageClient
from .._poses import pose, quat_xyzw
from ._policy import Action, Observation, Policy

_NEWS = 0.2  # s without a state, after which there is nothing to act on


def leader_of(state: dict[str, Any]) -> str | None:
    """Whose hand the robot follows, of a state message: the first tool's that follows any."""
    return next((str(tool["leader"]) for tool in state["tools"] if tool["leader"]), None)


def _observation(state: dict[str, Any], things: list[str]) -> Observation:
    def matrix(of: dict[str, Any]) -> Any:
        return pose(of["p"], of["q"])

    def of_tools(name: str, made: Any = lambda value: value, join: Any = tuple) -> Any:
        """The value of the tool, or of several all."""
        values = [made(tool[name]) for tool in state["tools"]]
        return values[0] if len(values) == 1 else join(values)

    task = state["task"]
    return Observation(
        t=state["now_s"], state=state["state"], reason=state["reason"], leader=leader_of(state),
        q=np.array(state["q"], dtype=float), dq=np.array(state["dq"], dtype=float), command=np.array(state["command"], dtype=float),
        gripper=of_tools("gripper"), gripper_command=of_tools("gripper_command"),
        T_base_tool=of_tools("pose", matrix, np.array), T_base_target=of_tools("target", matrix, np.array),
        things={name: pose(at[:3], at[3:]) for name, at in zip(things, task["things"])} if task else {},
    )  # fmt: skip


def _targets(action: Action, of: float) -> list[dict[str, Any]]:
    """A message for each tool."""
    poses = np.asarray(action.T_base_tool, dtype=np.float64)
    poses = poses[None] if poses.ndim == 2 else poses
    grippers = action.gripper if isinstance(action.gripper, (tuple, list, np.ndarray)) else [action.gripper]
    messages = []
    for tool, T in enumerate(poses):
        known = T.shape == (4, 4) and bool(np.isfinite(T).all())
        message: dict[str, Any] = {"type": "target", "of_s": of, "p": T[:3, 3].tolist() if known else None, "q": quat_xyzw(T).tolist() if known else None}
        if tool < len(grippers) and (gripper := grippers[tool]) is not None:
            message["gripper"] = min(max(float(gripper), 0.0), 1.0)
        messages.append(message | ({"tool": tool} if tool else {}))
    return messages


def lead(policy: Policy, port: int = 8642, *, name: str = "", turn: bool = False, seconds: float | None = None, say: Callable[[str], None] = print) -> None:
    """Connects the policy to the session on this machine, and acts until that ends, or for this many seconds.

    It acts at its own pace on the newest state. A person at the page gives it its turn; with turn=True this program takes
    control if no client has it, and gives the turn itself: then the user who started it is responsible, and can stop it with Ctrl-C.
    say: gets lines for people. Raises steadyhand._page_client.Lost, a ConnectionError, when the program ends.
    """
    client = PageClient(port)
    try:
        _act(client, policy, name or type(policy).__name__, turn, seconds, say)
    finally:
        client.close()


def _act(client: PageClient, policy: Policy, name: str, turn: bool, seconds: float | None, say: Callable[[str], None]) -> None:
    client.send(type="policy", name=name, period_s=policy.period)
    begin = time.monotonic()
    due, state, things, heard, asked, leader = begin, None, [], begin, False, None
    while seconds is None or time.monotonic() < begin + seconds:
        for message in client.messages(max(0.001, min(due - time.monotonic(), 0.02))):
            if message["type"] == "welcome":
                things = message["task"]["things"] if message["task"] else []
            elif message["type"] == "state":
                state, heard = message, time.monotonic()
            elif message["type"] == "error":
                say(f"steadyhand: {message['message']}")
        if state is None or time.monotonic() < due:
            continue
        due = max(due + policy.period, time.monotonic())
        if leader_of(state) != leader:
            leader = leader_of(state)
            say(f"{state['now_s']:.1f} s: {leader or 'nobody'} leads ({state['reason']})")
        if turn and not asked and state["state"] in ("ready", "engaged", "holding") and leader in (None, "recording"):
            asked = True
            client.send(type="take")
            client.send(type="request", kind="policy", value=1)
        if time.monotonic() - heard < _NEWS:
            for target in _targets(policy.act(_observation(state, things)), state["now_s"]):
                client.send(**target)
