"""The command `steadyhand score` (docs/how-to/record-data.md)."""

from __future__ import annotations

import functools
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from .._command_line import Parser, exit_code
from .._files import csv_of, write_whole
from .._jobs import add_workers, do_each, robot_of, sessions_of, workers_of
from .._replay import read_session
from .._robot import Robot
from ._scores import Score, score, table


def _parser() -> Parser:
    parser = Parser(
        prog="steadyhand score",
        description="Scores recorded sessions, as recorded or planned again under other profiles: one row for each session and profile.",
        epilog="Exit codes: 0 done, omitted parts are listed on stderr; 2 bad input, or nothing could be scored, with the reason on stderr.",
        allow_abbrev=False,
    )
    parser.add_argument("sessions", nargs="+", metavar="SESSION", help="a session's MCAP, or a folder of them")
    parser.add_argument("--profile", nargs="+", default=[], metavar="NAME", help="plan the hands again under these profiles, names or files (default: score the recording)")
    parser.add_argument("--rate", type=float, metavar="HZ", help="plans per second (default: as recorded)")
    parser.add_argument("--keep", metavar="DIR", help="folder for the new plans, as SESSION-PROFILE.mcap, for `dataset` and `report`")
    parser.add_argument("--out", metavar="FILE", help="write all figures as CSV")
    parser.add_argument("--robot", metavar="ROBOT", help="robot of the sessions, by name or file (default: as recorded)")
    add_workers(parser, "score sessions")
    return parser


def _replayed(path: Path, robot: str, profile: str, rate: float | None, folder: Path) -> Path:
    """The recording of what `profile` makes of the session's hand. Raises ValueError with the program's words."""
    words = ["replay", str(path), "--robot", robot, "--profile", profile, "--out", str(folder)] + ([] if rate is None else ["--rate", str(rate)])
    done = subprocess.run([sys.executable, "-m", "steadyhand", *words], capture_output=True, text=True, env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}, check=False)
    if done.returncode != 0:
        raise ValueError(done.stderr.strip().removeprefix("steadyhand: ") or f"its replay ended with {done.returncode}")
    (made,) = folder.glob("*/session.mcap")
    return made


def _scores_of(path: Path, robot: str | None, profiles: Sequence[str], rate: float | None, keep: Path | None) -> tuple[list[Score], list[str]]:
    """Of one session; why it was left out, if it was."""
    found = []
    try:
        session = read_session(path)
        name = robot or robot_of(session)
        model = Robot(name)
        lost = [f"{path}: {loss.reason}" for loss in session.lost]
        if not profiles:
            return [score(session, model)], lost
        for profile in profiles:
            with tempfile.TemporaryDirectory() as folder:
                made = _replayed(path, name, profile, rate, Path(folder))
                found.append(score(read_session(made), model, Path(profile).stem)._replace(session=session.name))
                if keep:
                    write_whole(keep / f"{path.stem}-{Path(profile).stem}.mcap", made.read_bytes())
        return found, lost
    except (ValueError, OSError) as error:
        return [], [str(error) if str(path) in str(error) else f"{path}: {error}"]


def run(words: list[str]) -> int:
    """The command; its exit code. Raises ValueError for bad input."""
    arguments = _parser().parse_args(words)
    workers = workers_of(arguments)
    if arguments.robot:
        Robot(arguments.robot)
    if arguments.rate is not None and not 1.0 <= arguments.rate <= 500.0:
        raise ValueError(f"--rate is {arguments.rate:g}; it must be from 1 to 500 Hz")
    if not arguments.profile and (arguments.keep or arguments.rate is not None):
        raise ValueError(f"--{'keep' if arguments.keep else 'rate'}: --profile is missing; it selects the profiles of new plans")
    if twice := [name for k, name in enumerate(arguments.profile) if Path(name).stem in {Path(other).stem for other in arguments.profile[:k]}]:
        raise ValueError(f"--profile: '{twice[0]}' is named twice; give each once")
    files = sessions_of(arguments.sessions)
    keep = Path(arguments.keep).resolve() if arguments.keep else None
    if keep and len({path.stem for path in files}) < len(files):
        raise ValueError("--keep: two of the sessions have the same name; run the command once for each folder")
    if keep:
        keep.mkdir(parents=True, exist_ok=True)
    profiles = [str(Path(name).resolve()) if Path(name).is_file() else name for name in arguments.profile]
    job = functools.partial(_scores_of, robot=arguments.robot, profiles=profiles, rate=arguments.rate, keep=keep)
    answers = do_each(job, files, workers)
    scores = []
    for path in files:
        found, left_out = answers.get(path, ([], [f"{path}: the process that scored it was killed"]))
        scores += found
        for line in left_out:
            print(f"steadyhand: left out: {line}", file=sys.stderr)
    if not scores:
        raise ValueError("no session could be scored")
    if arguments.out:
        write_whole(Path(arguments.out), csv_of(Score._fields, scores))
    print(table(scores))
    return 0


def main(words: list[str]) -> int:
    """The command's exit code; bad input is printed to stderr."""
    return exit_code(run, words)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
