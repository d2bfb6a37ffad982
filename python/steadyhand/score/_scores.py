"""Figures of a session: how closely the arm followed, what was spilled, how smooth its commands are."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .._arrays import Array
from .._replay import Commands, Session
from .._robot import Robot
from .._stages import Liquid

FRAME = 1 / 30
"""s, between the commands that a policy would learn from."""
JUMP = 15.0
"""rad/s^2 (m/s^2): a frame whose command bends more than this jumps."""
RECORDED = "as recorded"


class Score(NamedTuple):
    """Of one session under one profile."""

    session: str
    profile: str
    """Or RECORDED."""
    seconds: float
    """s, of the session."""
    followed_s: float
    """s, in which the arm followed the hand; what follows is of those."""
    position_rms_mm: float
    """Tracking error of the tool's position, RMS."""
    orientation_rms_deg: float
    lateral_mean_m_s2: float
    """Specific force across the glass, mean."""
    spilled_percent: float
    """Share of the liquid spilled from a glass like `steadyhand.Liquid()`, over all commands."""
    speed_percent: float
    """Largest joint speed, of its limit, over all commands."""
    bend_max: float
    """Largest change of a command's change from frame to frame, as an acceleration, rad/s^2 (m/s^2)."""
    jumps_percent: float
    """Frames that bend more than JUMP."""
    clearance_mm: float
    """Smallest, between bodies, over all plans."""
    plans: int
    refused: int
    """Refused plans: the arm then followed the previous one."""
    solve_us: float
    """Median time of the solver."""
    episodes: int
    """That were marked and kept."""
    succeeded: int
    """Of those."""


def score(session: Session, robot: Robot, profile: str = RECORDED) -> Score:
    """Raises ValueError for a session in which nothing was planned or commanded, and for a robot with other joints."""
    if robot.joint_names != session.joint_names:
        raise ValueError(f"{session.name} has the joints {', '.join(session.joint_names)}; the robot {robot.name} has {', '.join(robot.joint_names)}")
    steps, commands = session.steps, session.commands
    if not len(steps.t) or len(commands.t) < 2:
        raise ValueError(f"{session.name}: has no plans, or no commands")
    # of all tools: (m, tools, ...)
    target, tool = (T.reshape(len(steps.t), -1, 4, 4) for T in (steps.T_base_target, steps.T_base_tool))
    engaged = steps.engaged.reshape(len(steps.t), -1)
    rows = engaged & np.isfinite(target).all(axis=(2, 3))
    apart = target[rows][:, :3, 3] - tool[rows][:, :3, 3]
    turned = np.einsum("kij,kij->k", target[rows][:, :3, :3], tool[rows][:, :3, :3])
    angles = np.degrees(np.arccos(np.clip((turned - 1.0) / 2.0, -1.0, 1.0)))
    bends = _bends(commands)
    kept = [episode for episode in session.episodes if episode.kept]
    return Score(
        session.name, profile, session.duration, float(np.diff(steps.t)[engaged[:-1].any(axis=1)].sum()),
        1e3 * _rms(np.linalg.norm(apart, axis=1)), _rms(angles), _mean(np.linalg.norm(steps.local_acceleration.reshape(len(steps.t), -1, 3)[rows][:, :2], axis=1)),
        100.0 * _spilled(commands, robot), 100.0 * float(np.max(np.abs(commands.dq) / session.velocity_max)),
        float(bends.max(initial=0.0)), 100.0 * _mean(bends > JUMP), 1e3 * float(np.min(steps.clearance)),
        len(steps.t), int(np.sum(steps.status == "previous")), float(np.median(steps.solve_us)),
        len(kept), sum(episode.success is True for episode in kept),
    )  # fmt: skip


def _mean(values: np.ndarray) -> float:
    return float(np.mean(values)) if len(values) else float("nan")


def _rms(values: Array) -> float:
    return float(np.sqrt(_mean(values**2)))


def _bends(commands: Commands) -> Array:
    """(m,): of each frame, the largest of any joint."""
    t = np.arange(commands.t[0], commands.t[-1], FRAME)
    actions = np.column_stack([np.interp(t, commands.t, column) for column in commands.q.T])
    return np.abs(np.diff(actions, 2, axis=0)).max(axis=1, initial=0.0) / FRAME**2


def _spilled(commands: Commands, robot: Robot) -> float:
    """Share of the liquid; of several glasses, the largest."""
    liquids, shares = [Liquid() for _ in robot.tool_names], [0.0 for _ in robot.tool_names]
    for dt, q, dq, ddq in zip(np.diff(commands.t), commands.q, commands.dq, commands.ddq):
        for tool, liquid in enumerate(liquids):
            if dt > 0.0:
                shares[tool] = liquid.update(min(float(dt), 10.0), robot.local_acceleration(q, dq, ddq, tool)).spilled_share
    return max(shares)


_COLUMNS = {
    "followed, s": "followed_s", "position, RMS, mm": "position_rms_mm", "orientation, RMS, deg": "orientation_rms_deg", "lateral, m/s2": "lateral_mean_m_s2",
    "spilled, %": "spilled_percent", "joint speed, %": "speed_percent", "jumps, %": "jumps_percent", "clearance, mm": "clearance_mm", "plans refused": "refused",
}  # fmt: skip


def table(scores: Sequence[Score]) -> str:
    """In Markdown; the last row of each profile is the mean over its sessions."""
    heads = ["session", "profile", *_COLUMNS]
    lines = [heads, ["---"] * len(heads)]
    lines += [[each.session, each.profile, *(f"{getattr(each, key):.4g}" for key in _COLUMNS.values())] for each in scores]
    for profile in dict.fromkeys(each.profile for each in scores):
        group = [each for each in scores if each.profile == profile]
        if len(group) > 1:
            lines.append([f"mean of {len(group)}", profile, *(f"{np.mean([getattr(each, key) for each in group]):.4g}" for key in _COLUMNS.values())])
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
