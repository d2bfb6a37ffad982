"""A session cut into episodes, with all its streams on one clock of frames."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from .._arrays import Array
from .._poses import quat_xyzw
from .._replay import Episode as Marked
from .._replay import Loss, Session
from .._robot import Robot
from ._video import PICTURE_PAUSE, Film, Video, lay

EPISODES = ("auto", "marked", "grips", "session")
LONGEST_GAP = 0.05
"""s: an episode is left out if its measured states or its commands pause longer."""


@dataclass(frozen=True)
class Frames:
    """One quantity in every frame of an episode."""

    values: Array
    """(m, d)."""
    names: tuple[str, ...]
    """d of them: what each number is."""
    dtype: str = "float32"
    """Or "bool"."""


@dataclass(frozen=True)
class Episode:
    """What a policy learns from: m frames, frame k at k / fps."""

    session: str
    """The name of the recording."""
    start: float
    """s of the session's time, of frame 0."""
    fps: int
    robot: str
    task: str
    """What was to be done, in words."""
    features: dict[str, Frames]
    """By LeRobot's names: observation.state, observation.tool, operator.target (the targets of the tools; no policy has it), action;
    policy and intervention (whether a policy controlled the arm, and whether a person did in its turn);
    with a simulated scene observation.environment_state (its things), and in marked episodes next.success."""
    success: bool | None = None
    """Whether the task succeeded; None: not known."""
    notes: str = ""
    films: dict[str, Film] = field(default_factory=dict)
    """By LeRobot's names, observation.images.CAMERA."""

    def __len__(self) -> int:
        return len(self.features["action"].values)


@dataclass(frozen=True)
class _Motion:
    """Joints over time, between whose samples lines are drawn: those are 2 ms apart."""

    t: Array
    q: Array
    dq: Array

    def at(self, t: Array) -> tuple[Array, Array]:
        return _between(t, self.t, self.q), _between(t, self.t, self.dq)

    def longest_gap(self, begin: float, end: float) -> float:
        """s without a sample within [begin, end]."""
        inside = self.t[(self.t > begin) & (self.t < end)]
        return float(np.diff(np.concatenate([[begin], inside, [end]])).max())


def _between(t: Array, at: Array, values: Array) -> Array:
    return np.column_stack([np.interp(t, at, column) for column in values.T])


def _pose(T: Array) -> Array:
    """(m, 7): position in m and quaternion x, y, z, w, without jumps of sign from frame to frame."""
    quaternions = quat_xyzw(T)
    flips = np.cumsum(np.einsum("ij,ij->i", quaternions[1:], quaternions[:-1]) < 0.0) % 2
    quaternions[1:][flips == 1] *= -1.0
    return np.hstack([T[:, :3, 3], quaternions])


_POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")


def _prefixes(robot: Robot) -> list[str]:
    """What goes before the names of each tool's values: of several tools its name, as LeRobot's bi_* robots have it."""
    return [""] if robot.tool_count == 1 else [f"{name}_" for name in robot.tool_names]


def _poses(robot: Robot, name: str, poses: list[Array]) -> Frames:
    """(m, 7) of each tool, of its (m, 4, 4)."""
    return Frames(np.hstack([_pose(T) for T in poses]), tuple(f"{of}{name}.{number}" for of in _prefixes(robot) for number in _POSE))


def _with_grippers(frames: Frames, robot: Robot, t: Array, at: Array, values: Array) -> Frames:
    """Adds those of the tools that have one, at times t. values: (k,) or (k, tools), at times `at`."""
    for of, column in zip(_prefixes(robot), values.reshape(len(at), -1).T):
        if np.isfinite(column).all():
            frames = Frames(np.hstack([frames.values, _between(t, at, column[:, None])]), (*frames.names, f"{of}gripper.pos"))
    return frames


def _any_engaged(session: Session) -> np.ndarray:
    """(m,), of the session's steps: whether any tool followed its hand."""
    return session.steps.engaged.reshape(len(session.steps.t), -1).any(axis=1)


def _joints(session: Session, *what: str) -> tuple[str, ...]:
    return tuple(f"{joint}.{kind}" for kind in what for joint in session.joint_names)


def _absolute(session: Session, robot: Robot, commands: _Motion, t: Array, step: float) -> Frames:
    return Frames(commands.at(t + step)[0], _joints(session, "pos"))


def _delta(session: Session, robot: Robot, commands: _Motion, t: Array, step: float) -> Frames:
    return Frames(commands.at(t + step)[0] - commands.at(t)[0], _joints(session, "delta"))


def _tool(session: Session, robot: Robot, commands: _Motion, t: Array, step: float) -> Frames:
    q = commands.at(t + step)[0]
    return _poses(robot, "tool", [robot.fk(q, tool) for tool in range(robot.tool_count)])


def _set_point(session: Session, robot: Robot, commands: _Motion, t: Array, step: float) -> Frames:
    return Frames(np.hstack(commands.at(t + step)), _joints(session, "pos", "vel"))


ACTIONS: dict[str, Callable[[Session, Robot, _Motion, Array, float], Frames]] = {
    "joints": _absolute,
    "delta": _delta,
    "pose": _tool,
    "command": _set_point,
}
"""What `action` may be. Each is what was commanded for the end of the frame's interval, and none a copy of the state:
"joints": positions; "delta": positions less those commanded at its begin; "pose": of the tool in the base, x, y, z in m and
quaternion x, y, z, w; "command": positions and velocities. Values of a robot's several tools, and grippers, have the tool's name
before theirs, as left_tool.x and left_gripper.pos."""


@dataclass(frozen=True)
class _Stretch:
    begin: float
    end: float
    """s, of the session."""
    marked: Marked | None = None

    def meets(self, loss: Loss) -> bool:
        return loss.begin < self.end and self.begin < loss.end


def _without(stretches: list[_Stretch], loss: Loss) -> list[_Stretch]:
    """What is before and after a damaged part of the file."""
    return [piece for each in stretches for piece in ([_Stretch(each.begin, loss.begin), _Stretch(loss.end, each.end)] if each.meets(loss) else [each]) if piece.begin < piece.end]


def _stretches(session: Session, episodes: str) -> tuple[list[_Stretch], list[str]]:
    """Those that are wanted, and a line on each that is not."""
    steps = session.steps
    if episodes == "marked" or (episodes == "auto" and session.episodes):
        wanted = [each for each in session.episodes if each.kept and each.end is not None]
        left_out = [f"{session.name}, episode {each.number}: {'discarded' if each.end is not None else 'neither kept nor discarded'}" for each in session.episodes if not each.kept]
        return [_Stretch(each.begin, each.end, each) for each in wanted if each.end is not None], left_out
    if not len(steps.t):
        return [], []
    found = []
    follows = _any_engaged(session)
    for engaged, group in itertools.groupby(range(len(steps.t)), key=lambda k: episodes == "session" or bool(follows[k])):
        rows = list(group)
        if engaged:
            found.append(_Stretch(float(steps.t[rows[0]]), float(steps.t[rows[-1]])))
    for loss in session.lost:
        found = _without(found, loss)
    return found, []


def _scene_features(session: Session, t: Array) -> dict[str, Frames]:
    """Things at the frames' times: the look before each, 16 ms old at most."""
    scenes = session.scenes
    if not len(scenes.t) or not scenes.things:
        return {}
    rows = np.clip(np.searchsorted(scenes.t, t, side="right") - 1, 0, None)
    values = np.hstack([_pose(poses[rows]) for poses in scenes.things.values()])
    return {"observation.environment_state": Frames(values, tuple(f"{thing}.{name}" for thing in scenes.things for name in _POSE))}


def _leaders(session: Session, t: Array) -> dict[str, Frames]:
    """Source of the hand at each frame's time: the newest sample before it with a closed hand, while the arm followed."""
    hand, steps = session.hand, session.steps
    if hand.leader is None or hand.intervention is None:
        return {}
    rows = np.clip(np.searchsorted(steps.t, t, side="right") - 1, 0, None)
    closed = np.flatnonzero(hand.clutch)
    at = np.searchsorted(hand.t[closed], t, side="right") - 1
    follows = _any_engaged(session)[rows] & (at >= 0) if len(closed) else np.zeros(len(t), dtype=bool)
    newest = closed[np.clip(at, 0, None)] if len(closed) else np.zeros(len(t), dtype=int)
    flags = {"policy": hand.leader == "policy", "intervention": hand.intervention}
    return {name: Frames((follows & (flag[newest] if len(closed) else False))[:, None], (name,), "bool") for name, flag in flags.items()}


def cut(
    session: Session,
    robot: Robot,
    *,
    fps: int = 30,
    action: str = "joints",
    task: str = "",
    episodes: str = "auto",
    shortest: float = 1.0,
    videos: dict[str, Video] | None = None,
    picture_pause: float = PICTURE_PAUSE,
) -> tuple[list[Episode], list[str]]:
    """The episodes of a session, and a line on each stretch that was left out.

    robot: the one that moved; its joints must be the session's. fps: frames a second, 1 to 500. action: a key of ACTIONS.
    task: the task in words, for a session without one. episodes: "marked", those that were marked and kept;
    "grips", from engaging to release; "session", all of it; "auto", marked if the session has marks, otherwise grips.
    shortest: s; what is shorter is left out. Every stream is sampled at the frames' times, between its own samples along lines.
    videos: of its cameras, see read_videos; each frame takes the picture that was exposed nearest. picture_pause: s; where a camera has none for
    longer the episode is left out.
    Raises ValueError for what is out of range, and for a robot with other joints.
    """
    if fps != int(fps) or not 1 <= fps <= 500:
        raise ValueError(f"fps is {fps}; it must be a whole number from 1 to 500")
    if action not in ACTIONS:
        raise ValueError(f'action is "{action}"; it must be one of {", ".join(ACTIONS)}')
    if episodes not in EPISODES:
        raise ValueError(f'episodes is "{episodes}"; it must be one of {", ".join(EPISODES)}')
    if robot.joint_names != session.joint_names:
        raise ValueError(f"{session.name} has the joints {', '.join(session.joint_names)}; the robot {robot.name} has {', '.join(robot.joint_names)}")
    commands = _Motion(session.commands.t, session.commands.q, session.commands.dq)
    states = _Motion(session.states.t, session.states.q, session.states.dq)
    if not len(commands.t) or not len(states.t):
        return [], [f"{session.name}: has no commands, or no measured states"]
    found = []
    stretches, left_out = _stretches(session, episodes)
    left_out = [f"{session.name}: {loss.reason}" for loss in session.lost] + left_out
    for stretch in stretches:
        begin, end = max(stretch.begin, commands.t[0], states.t[0]), min(stretch.end, commands.t[-1], states.t[-1])
        where = f"{session.name}, {begin:.1f} to {end:.1f} s"
        frames = int(np.floor((end - begin) * fps + 1e-9))  # the action of the last one ends within
        if end - begin < shortest or frames < 1:
            left_out.append(f"{where}: shorter than {max(shortest, 1 / fps):g} s")
            continue
        if any(stretch.meets(loss) for loss in session.lost):
            left_out.append(f"{where}: a part of it is damaged in the file")
            continue
        pause = max(motion.longest_gap(begin, end) for motion in (commands, states))
        if pause > LONGEST_GAP:
            left_out.append(f"{where}: {1e3 * pause:.0f} ms are not recorded")
            continue
        t = begin + np.arange(frames) / fps
        q, dq = states.at(t)
        rows = np.clip(np.searchsorted(session.steps.t, t, side="right") - 1, 0, None)
        features = {
            "observation.state": _with_grippers(Frames(np.hstack([q, dq]), _joints(session, "pos", "vel")), robot, t, session.states.t, session.states.gripper),
            "observation.tool": _poses(robot, "tool", [robot.fk(q, tool) for tool in range(robot.tool_count)]),
            "operator.target": _poses(robot, "target", list(session.steps.T_base_target[rows].reshape(len(t), -1, 4, 4).swapaxes(0, 1))),
            "action": _with_grippers(ACTIONS[action](session, robot, commands, t, 1 / fps), robot, t + 1 / fps, session.commands.t, session.commands.gripper),
        } | _scene_features(session, t) | _leaders(session, t)
        marked = stretch.marked
        if marked:
            succeeds = (np.arange(frames) == frames - 1) & bool(marked.success)
            features["next.success"] = Frames(succeeds[:, None], ("success",), "bool")
        broken = [name for name, frames_of in features.items() if not np.isfinite(frames_of.values).all()]
        if broken:
            left_out.append(f"{where}: {', '.join(broken)} not finite")
            continue
        try:
            films = {f"observation.images.{name}": lay(name, video, t, picture_pause) for name, video in (videos or {}).items()}
        except ValueError as error:
            left_out.append(f"{where}: {error}")
            continue
        words = (marked.task if marked else "") or session.metadata.get("task", {}).get("instruction", "") or task
        found.append(Episode(session.name, float(begin), int(fps), robot.name, words, features, *((marked.success, marked.notes) if marked else (None, "")), films))
    return found, left_out
