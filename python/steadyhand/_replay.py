"""Replays of recorded hands, and recorded sessions, as arrays."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _native
from ._arrays import Array, array, flags, number, text
from ._cell import CellLike, as_cell
from ._documented import document
from ._glass import GlassLike, glass_of
from ._options import Weights, options
from ._objective import Objective, bound
from ._robot import Robot, as_robot, opened


@dataclass(frozen=True)
class Hand:
    """Motion of a hand: m samples."""

    t: Array
    """(m,), s, from the first sample."""
    T_operator_hand: Array
    """(m, 4, 4): in the operator frame with robot axes (z up), m."""
    clutch: np.ndarray
    """(m,), bool: closed, the arm is engaged."""
    tracked: np.ndarray
    """(m,), bool: whether the device had a pose."""
    gripper: Array | None = None
    """(m,), 0 open to 1 closed; NaN: not set by the operator. None: the hand has no gripper input."""
    leader: np.ndarray | None = None
    """(m,), text: source of the pose: "person", "recording" (playback) or "policy" (its poses are those of the tool in the base)."""
    intervention: np.ndarray | None = None
    """(m,), bool: a person controls the arm during a policy's turn."""
    tool: np.ndarray | None = None
    """(m,), int: index of the tool that the hand moves; None: 0. Times of one hand increase, those of all never go back."""


@dataclass(frozen=True)
class Steps:
    """Figures of m planning steps. Of robots with two tools, arrays of a tool have an axis for it: T_base_target is
    (m, 2, 4, 4), local_acceleration (m, 2, 3), engaged (m, 2)."""

    t: Array
    """(m,), s."""
    T_base_target: Array
    """(m, 4, 4), m: target of the tool, in the base."""
    T_base_tool: Array
    """(m, 4, 4), m: planned pose of the tool, in the base."""
    q: Array
    """(m, n), rad (m)."""
    dq: Array
    """(m, n), rad/s (m/s)."""
    ddq: Array
    """(m, n), rad/s^2 (m/s^2)."""
    local_acceleration: Array
    """(m, 3), m/s^2: specific force in the tool frame; (0, 0, 9.81) at rest and upright."""
    objective: Array
    """(m,), cost J of the plan."""
    shares: dict[str, Array]
    """By name of the term, (m,): its share of J."""
    iterations: Array
    """(m,), iterations of the solver."""
    solve_us: Array
    """(m,), us, wall time of the solver."""
    status: np.ndarray
    """(m,), text: "solved", "feasible" or "previous", as Plan.status."""
    clearance: Array
    """(m,), m: smallest distance between the arm's bodies over the plan."""
    engaged: np.ndarray
    """(m,), bool: the arm followed the hand."""
    object_distances: dict[str, Array]
    """By name of the object, (m,), m: distance from the arm to it, without its margin; NaN while it did not exist."""


@dataclass(frozen=True)
class Commands:
    """m set-points of the arm."""

    t: Array
    """(m,), s."""
    q: Array
    """(m, n), rad (m)."""
    dq: Array
    """(m, n), rad/s (m/s)."""
    ddq: Array
    """(m, n), rad/s^2 (m/s^2)."""
    gripper: Array
    """(m,), 0 open to 1 closed; NaN: the arm has none. Robots with two tools: (m, 2)."""


@dataclass(frozen=True)
class States:
    """m measured states of the arm."""

    t: Array
    """(m,), s."""
    q: Array
    """(m, n), rad (m)."""
    dq: Array
    """(m, n), rad/s (m/s)."""
    gripper: Array
    """(m,), 0 open to 1 closed; NaN: the arm has none. Robots with two tools: (m, 2)."""


@dataclass(frozen=True)
class Change:
    """A change of the supervision's state."""

    t: float
    """s."""
    state: str
    """State after the change."""
    before: str
    """State before the change."""
    reason: str
    tool: int = 0
    """Index of the tool; a change of the whole robot comes for each."""


@dataclass(frozen=True)
class Setting:
    """Settings of the operator from time t (s) on."""

    t: float
    weights: dict[str, list[float]]
    """By name of the term; empty: unchanged."""
    scale: float
    """Tool motion divided by hand motion."""
    yaw: float
    """rad, turn of the operator frame about the base's z axis."""


@dataclass(frozen=True)
class Replay:
    """Result of a replay."""

    robot: Robot
    profile: str
    rate: float
    """Hz, plans per second."""
    hand: Hand
    steps: Steps
    """One for each plan."""
    commands: Commands
    """At 500 Hz."""
    not_followed: int
    """Number of samples that were rejected: implausible jumps, or gaps over 0.1 s."""


@dataclass(frozen=True)
class Episode:
    """A part of a session that a person or program marked."""

    number: int
    """Number in its session, from 1."""
    begin: float
    """s."""
    end: float | None
    """s; None: the session ended before the episode was kept or discarded."""
    kept: bool
    success: bool | None
    """Whether the task succeeded; None: unknown."""
    task: str
    """The task in words; "": not given."""
    notes: str


@dataclass(frozen=True)
class Scenes:
    """k states of a session's simulated scene; k = 0: the session had none."""

    t: Array
    """(k,), s."""
    things: dict[str, Array]
    """By name of the thing, its poses in the base, (k, 4, 4), m."""
    reset: Array
    """(k,): number of set-ups of the scene so far."""
    spilled: Array
    """(k,): spilled share of the liquid since the last set-up."""
    success: Array
    """(k,): 1 or 0 once the task is decided, NaN before."""


@dataclass(frozen=True)
class Loss:
    """A damaged part of a session's file, whose messages are missing."""

    begin: float
    """s, time of the last message before it."""
    end: float
    """s, time of the first message after it; equal to begin: there is none."""
    reason: str
    """Includes the position in bytes."""


@dataclass(frozen=True)
class Session:
    """A recorded session. Times count from its start."""

    name: str
    complete: bool
    """False: its writer was killed; the data ends there."""
    duration: float
    """s, length."""
    metadata: dict[str, dict[str, str]]
    """"run": the settings; "robot": the robot as JSON."""
    joint_names: tuple[str, ...]
    tool_names: tuple[str, ...]
    """One for each arm; empty: one, whose name is not recorded."""
    joint_units: tuple[str, ...]
    velocity_max: Array
    acceleration_max: Array
    hand: Hand
    steps: Steps
    commands: Commands
    states: States
    changes: list[Change]
    settings: list[Setting]
    episodes: list[Episode]
    """Marked episodes, in order."""
    scenes: Scenes
    lost: list[Loss]
    """Damaged parts of the file that could not be read."""


def _hand(columns: dict[str, Any]) -> Hand:
    return Hand(columns["t"], columns["T_operator_hand"], columns["clutch"] != 0, columns["tracked"] != 0, columns["gripper"], np.array(columns["leader"], dtype="U9"), columns["intervention"] != 0, columns["tool"].astype(int))


def _steps(columns: dict[str, Any]) -> Steps:
    columns["status"] = np.array(columns["status"], dtype="U8")
    columns["iterations"] = columns["iterations"].astype(int)
    columns["engaged"] = columns["engaged"] != 0
    return Steps(**columns)


def _episodes(marks: list[tuple[float, int, str, bool | None, str, str]]) -> list[Episode]:
    """The episodes of a session: for each of their properties the last mark counts."""
    said: dict[int, dict[str, Any]] = {}
    for t, number, kind, success, task, notes in marks:
        episode = said.setdefault(number, {"number": number, "begin": t, "end": None, "kept": False, "success": None, "task": "", "notes": ""})
        if kind in ("keep", "discard"):
            episode["kept"] = kind == "keep"
            if episode["end"] is None:
                episode["end"] = t
        episode |= {key: value for key, value in (("success", success), ("task", task or None), ("notes", notes or None)) if value is not None}
    return [Episode(**said[number]) for number in sorted(said)]


def _scenes(columns: dict[str, Any], metadata: dict[str, dict[str, str]]) -> Scenes:
    poses = columns.pop("things")
    names = metadata.get("task", {}).get("things", "").split(",")
    return Scenes(things=dict(zip(names if len(names) == len(poses) else map(str, range(len(poses))), poses)), **columns)


def _from_arrays(recording: Any) -> Any:
    if not isinstance(recording, (tuple, list)) or len(recording) not in (2, 3, 4):
        raise TypeError(
            "recording must be the path of a file, a Hand, or arrays (t, T_operator_hand) or (t, T_operator_hand, clutch), with two "
            f"hands (t, T_operator_hand, clutch, tool), not {type(recording).__name__}"
        )
    t = array("t", recording[0], ("m",), what="times in s")
    T = array("T_operator_hand", recording[1], (len(t), 4, 4), what="a pose for each time")
    clutch = flags("clutch", recording[2], len(t), "one for each time") if len(recording) > 2 else np.ones(len(t), dtype=bool)
    tool = array("tool", recording[3], (len(t),), what="an index for each time") if len(recording) > 3 else np.zeros(len(t))
    return _native.make_hand(t, T, clutch.astype(np.float64), tool)


def replay(
    recording: str | os.PathLike[str] | Hand | tuple[ArrayLike, ...],
    profile: str | os.PathLike[str] | None = None,
    rate: float | None = None,
    *,
    robot: Robot | str | os.PathLike[str] = "ur5e",
    track: str = "",
    start: float = 0.0,
    until: float | None = None,
    scale: float | None = None,
    yaw: float | None = None,
    translation_frame: str | None = None,
    rotation_frame: str | None = None,
    tilt: float | None = None,
    glass: GlassLike | None = None,
    solver: str | None = None,
    weights: Weights | None = None,
    objectives: Iterable[Objective] = (),
    cell: CellLike | None = None,
) -> Replay:
    """Runs a recorded hand through all stages without an arm, like the command `steadyhand replay`.

    recording: the path of a file (CSV, A-Frame motion capture, or the MCAP of a session; the session's profile, rate, scale and yaw
    are then the defaults), a Hand, or arrays t (m,) in s, T_operator_hand (m, 4, 4) in robot axes and m, and optionally clutch (m,)
    and tool (m,), the index of the tool that the hand of each row moves.
    profile: as Planner; default "tracking". rate: Hz, plans per second, 1 to 500; default 20.
    track: name of the hand in the file; of a robot with two tools one for each, as "lhand,rhand". start, until: s after the file's first sample. scale to glass: as Pipeline.
    weights, objectives: as Planner. cell: a Cell, or an argument of Cell(). Default: the session's cell with its changes, or
    "pedestal" (floor and column) for other recordings.

    Python's lock is released during the replay. Raises SteadyhandError (a ValueError) for invalid files and numbers;
    FileNotFoundError for a path that does not exist.
    """
    model = as_robot(robot)
    given = options(rate=rate, scale=scale, yaw=yaw, translation_frame=translation_frame, rotation_frame=rotation_frame, tilt=tilt, glass=glass_of(glass), solver=solver, weights=weights)
    given["objectives"] = bound(objectives, model)
    if isinstance(recording, Hand):
        count = np.size(recording.t)
        held = flags("clutch", recording.clutch, count, "one for each time") & flags("tracked", recording.tracked, count, "one for each time")
        recording = (recording.t, recording.T_operator_hand, held, np.zeros(count) if recording.tool is None else recording.tool)
    if isinstance(recording, (str, os.PathLike)):
        end = -1.0 if until is None else number("until", until, "seconds")
        if until is not None and end <= 0.0:
            raise ValueError(f"until is {end:g} s; it must be above 0")
        begin = number("start", start, "seconds")
        if _native.is_session(text("the name of the recording", os.fspath(recording))):
            hand, profile = _session_hand(recording, begin, end, profile, given)
            if cell is None:
                cell = _session_cell(recording)
            else:
                given["cell_fixed"] = True
        else:
            hand = opened("recording", recording, lambda path: _native.load_hand(path, text("track", track), begin, end, list(model.tool_names)))
    else:
        hand = _from_arrays(recording)
    given["cell"] = as_cell("pedestal" if cell is None else cell)._native
    profile = "tracking" if profile is None else profile
    answer = opened("profile", profile, lambda name: _native.replay(hand, model._native, name, given))
    return Replay(
        model, os.fspath(profile), given.get("rate", 20.0), _hand(hand.columns), _steps(answer["steps"]),
        Commands(**answer["commands"]), hand.not_followed,
    )  # fmt: skip


def _session_hand(path: Any, begin: float, end: float, profile: Any, given: dict[str, Any]) -> tuple[Any, Any]:
    """The hand of a session; its settings become the defaults, as in the command."""
    run = _native.session_run(os.fspath(path))
    for key, mine in (("scale", "scale_fixed"), ("yaw", "yaw_fixed")):
        if key in given:
            given[mine] = True
    if profile is not None:
        given["weights_fixed"] = True
    elif run.get("profile") in _native.names_in("profiles"):
        profile = run["profile"]
    if "rate_hz" in run:
        given.setdefault("rate", float(run["rate_hz"]))
    if "scale" in run:
        given.setdefault("scale", float(run["scale"]))
    if "yaw_deg" in run:
        given.setdefault("yaw", math.radians(float(run["yaw_deg"])))
    given["ramp"], given["accept_emulated"] = _native.live_ramp, True  # the live gate has judged them
    return _native.load_session_hand(os.fspath(path), begin, end, run.get("accept_emulated") == "true"), profile


def _session_cell(path: Any) -> str | None:
    name = _native.session_run(os.fspath(path)).get("cell")
    return name if name == "none" or name in _native.names_in("cells") else None


def read_recording(
    path: str | os.PathLike[str], *, track: str = "", start: float = 0.0, until: float | None = None, robot: Robot | str | os.PathLike[str] | None = None
) -> Hand:  # fmt: skip
    """Reads a recorded hand (docs/reference/recordings.md) in robot axes. At implausible jumps the clutch is open.

    track: name of the hand in the file. robot: whose tools the hands move; of one with two, both hands are read, and track names
    one for each, as "lhand,rhand". start, until: s after the file's first sample. Raises SteadyhandError for an invalid
    file, with line or key, value and valid values; FileNotFoundError for a path that does not exist.
    """
    end = -1.0 if until is None else number("until", until, "seconds")
    if until is not None and end <= 0.0:
        raise ValueError(f"until is {end:g} s; it must be above 0")
    begin = number("start", start, "seconds")
    return _hand(opened("recording", path, lambda name: _native.load_hand(name, text("track", track), begin, end, [] if robot is None else list(as_robot(robot).tool_names))).columns)


def read_session(path: str | os.PathLike[str]) -> Session:
    """Reads the recording of a live session or a replay (MCAP, docs/reference/recordings.md), even if it is incomplete or damaged.

    Raises SteadyhandError for a file that is not a session or cannot be read at all, with the position in bytes;
    FileNotFoundError for a path that does not exist.
    """
    answer = opened("session", path, _native.read_session)
    return Session(
        hand=_hand(answer.pop("samples")),
        steps=_steps(answer.pop("steps")),
        commands=Commands(**answer.pop("commands")),
        states=States(**answer.pop("states")),
        changes=[Change(t, after, before, reason, tool) for t, before, after, reason, tool in answer.pop("changes")],
        settings=[Setting(*setting) for setting in answer.pop("settings")],
        episodes=_episodes(answer.pop("episodes")),
        scenes=_scenes(answer.pop("scenes"), answer["metadata"]),
        lost=[Loss(*loss) for loss in answer.pop("lost")],
        **answer,
    )


document(globals())
