"""The command `steadyhand dataset` (docs/how-to/record-data.md)."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .._command_line import Parser, exit_code
from .._jobs import Workers, add_workers, do_each, robot_of, sessions_of, workers_of
from .._replay import read_session
from .._robot import Robot
from ._episodes import ACTIONS, EPISODES, Episode, cut
from ._video import PICTURE_PAUSE, read_videos


def _frames_a_second(text: str) -> int:
    try:
        rate = float(text)
    except ValueError:
        rate = 0.0
    if not 1 <= rate <= 500:
        raise ValueError(f"--fps is {text}; it must be a whole number from 1 to 500")
    if rate != int(rate):
        raise ValueError(f"--fps is {text}; data sets have whole numbers, such as {round(rate)}. Each frame takes the image exposed nearest to it, at any rate of the camera")
    return int(rate)


def _parser() -> Parser:
    parser = Parser(
        prog="steadyhand dataset",
        description="Makes a data set from recorded sessions, in the format of LeRobot (v3.0), robomimic or Rerun; appends to data sets and merges them (docs/how-to/record-data.md).",
        epilog="Exit codes: 0 done, omitted parts are listed on stderr; 2 bad input, with the reason on stderr.",
        allow_abbrev=False,
    )
    parser.add_argument("sessions", nargs="+", metavar="SESSION", help="MCAP of a session, a folder of them, or a LeRobot data set; data sets are merged before all sessions")
    parser.add_argument("--out", required=True, metavar="DIR", help="the data set; an existing one is extended. Other formats need a new file (robomimic) or folder (rerun)")
    parser.add_argument("--format", choices=("lerobot", "robomimic", "rerun"), default="lerobot", help="LeRobot's v3.0, one HDF5 file as robomimic reads it, without pictures, or a recording of each episode (.rrd) as Rerun shows it (lerobot)")
    parser.add_argument("--fps", default="30", metavar="N", help="frames per second, 1 to 500 (30)")
    parser.add_argument("--action", choices=ACTIONS, default="joints", help="content of an action: joint positions, their change, the tool's pose, or positions and velocities (joints)")
    parser.add_argument("--task", default="", metavar="TEXT", help="the task in words, for sessions without one")
    parser.add_argument("--episodes", choices=EPISODES, default="auto", help="kept episodes, from engaging to release, or the whole session (auto: marked if a session has marks, otherwise grips)")
    parser.add_argument("--shortest", type=float, default=1.0, metavar="S", help="shortest episode, s (1)")
    parser.add_argument("--robot", metavar="ROBOT", help="robot of the sessions, by name or file (default: as recorded)")
    parser.add_argument("--picture-pause", type=float, default=PICTURE_PAUSE, metavar="S", help="longest gap between frames of a camera, s; episodes with longer gaps are left out (0.1)")
    parser.add_argument("--no-video", action="store_true", help="leave out camera video")
    add_workers(parser, "read sessions")
    return parser


def _episodes_of(path: Path, robot: str | None, options: dict[str, Any]) -> tuple[list[Episode], list[str]]:
    """Of one session; why it was left out, if it was."""
    options = dict(options)
    try:
        session = read_session(path)
        name = robot or robot_of(session)
        videos = {} if options.pop("no_video") else read_videos(path)
        return cut(session, Robot(name), videos=videos, **options)
    except (ValueError, OSError) as error:
        return [], [str(error) if str(path) in str(error) else f"{path}: {error}"]


def read_sessions(files: list[Path], robot: str | None, options: dict[str, Any], workers: Workers = Workers()) -> tuple[list[Episode], list[str]]:
    """All sessions, in the order given. A worker that dies takes no other session with it."""
    answers = do_each(functools.partial(_episodes_of, robot=robot, options=options), files, workers)
    for path in files:
        answers.setdefault(path, ([], [f"{path}: the process that read it was killed"]))
    return [episode for path in files for episode in answers[path][0]], [line for path in files for line in answers[path][1]]


def tell_left_out(lines: list[str]) -> None:
    for line in lines:
        print(f"steadyhand: left out: {line}", file=sys.stderr)


def append(folder: str | Path, episodes: list[Episode]) -> None:
    """Makes LeRobot's data set, or appends to it, and says what it has now."""
    from ._lerobot import write

    info = write(folder, episodes)
    print(f"{folder}: {len(episodes)} episodes, {sum(map(len, episodes))} frames; {info['total_episodes']} and {info['total_frames']} in all")


def _merge(folder: str, sets: list[str], episodes: list[Episode]) -> None:
    from ._merge import merge

    info = merge(folder, sets, episodes)
    print(f"{folder}: {len(sets)} data sets and {len(episodes)} episodes of sessions; {info['total_episodes']} and {info['total_frames']} frames in all")


def _writer(format: str) -> Callable[[str, list[Episode]], int] | None:
    """Writer of a format that is written in full each time; None: LeRobot's, which can be appended to."""
    if format == "robomimic":
        from ._robomimic import write_robomimic

        return write_robomimic
    if format == "rerun":
        from ._rerun import write_rerun

        return write_rerun
    return None


def run(words: list[str]) -> int:
    """The command; its exit code. Raises ValueError for bad input."""
    arguments = _parser().parse_args(words)
    workers = workers_of(arguments)
    fps = _frames_a_second(arguments.fps)
    if not 0.0 <= arguments.shortest < float("inf"):
        raise ValueError(f"--shortest is {arguments.shortest}; it must be at least 0 s")
    if not 0.0 < arguments.picture_pause < float("inf"):
        raise ValueError(f"--picture-pause is {arguments.picture_pause:g}; it must be above 0 s")
    if arguments.robot:
        Robot(arguments.robot)
    no_video = arguments.no_video or arguments.format == "robomimic"
    extra = "dataset" + (",rerun" if arguments.format == "rerun" else "")
    try:
        if not no_video:
            import av  # noqa: F401

        from . import _lerobot  # noqa: F401
        from ._merge import is_set

        sets = [word for word in arguments.sessions if is_set(word)]
        if sets and (arguments.format != "lerobot" or no_video):
            raise ValueError(f"{sets[0]} is a data set: sets are merged into LeRobot's format, with all that they have; leave out {'--no-video' if arguments.format == 'lerobot' else '--format'}")
        write = _writer(arguments.format)
    except ImportError as error:
        raise ValueError(f"{error}; the extra [{extra}] of the package installs what a data set is written with") from None
    if write and Path(arguments.out).exists():
        raise ValueError(f"{arguments.out} is there already; --format {arguments.format} makes a new one: name another")
    if not write:
        _lerobot.is_there(Path(arguments.out))  # reports an invalid data set before it reads sessions
    sessions = [word for word in arguments.sessions if word not in sets]
    options = {"fps": fps, "action": arguments.action, "task": arguments.task, "episodes": arguments.episodes, "shortest": arguments.shortest, "no_video": no_video, "picture_pause": arguments.picture_pause}
    episodes, left_out = read_sessions(sessions_of(sessions), arguments.robot, options, workers) if sessions else ([], [])
    tell_left_out(left_out)
    if write:
        frames = write(arguments.out, episodes)
        print(f"{arguments.out}: {len(episodes)} episodes, {frames} frames")
        return 0
    if sets:
        _merge(arguments.out, sets, episodes)
    else:
        append(arguments.out, episodes)
    return 0


def main(words: list[str]) -> int:
    """The command's exit code; bad input is printed to stderr."""
    return exit_code(run, words)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
