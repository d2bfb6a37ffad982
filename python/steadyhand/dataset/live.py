"""`./steadyhand demo --dataset DIR`: what was kept in a session goes into a data set as soon as the session ends (docs/how-to/record-data.md)."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

from .._command_line import exit_code
from .._places import program as find_program
from .__main__ import append, read_sessions, tell_left_out
from ._episodes import ACTIONS
from ._lerobot import is_there, new_info, read_info

_FPS = 30


def _take_folder(words: list[str]) -> tuple[Path, list[str]]:
    """The value of --dataset, and the words without it."""
    folders, rest = [], []
    left = iter(words)
    for word in left:
        if word == "--dataset":
            folders.append(next(left, ""))
        elif word.startswith("--dataset="):
            folders.append(word.partition("=")[2])
        else:
            rest.append(word)
    if len(folders) != 1 or not folders[0]:
        raise ValueError("--dataset needs one folder")
    if "--no-recording" in rest:
        raise ValueError("--dataset: a data set is made of the session's recording; leave out --no-recording")
    return Path(folders[0]), rest


def _lead(words: list[str]) -> tuple[int, list[Path]]:
    """Runs the program, whose words and questions pass through; its exit code, and what it recorded."""
    alone = not sys.stdin.isatty()  # at a terminal Ctrl-C reaches the program by itself, and must not come twice
    process = subprocess.Popen([find_program(), "demo", *words], stdout=subprocess.PIPE, start_new_session=alone)
    for number in (signal.SIGINT, signal.SIGTERM):
        forward = alone or number == signal.SIGTERM
        signal.signal(number, lambda which, _: process.send_signal(which) if forward else None)
    assert process.stdout is not None
    said = b""
    while more := os.read(process.stdout.fileno(), 65536):
        said = (said + more)[-65536:]
        sys.stdout.buffer.write(more)
        sys.stdout.buffer.flush()
    code = process.wait()
    recorded = re.findall(rb"^recorded: (.+)$", said, re.MULTILINE)
    return code, [Path(os.fsdecode(path)) for path in recorded]


def _options(folder: Path, files: list[Path]) -> dict[str, Any]:
    """As the data set was made that is there, so that it can be appended to."""
    options: dict[str, Any] = {"fps": _FPS, "action": "joints", "task": "", "episodes": "marked", "shortest": 1.0, "no_video": False}
    if not is_there(folder):
        return options
    info = read_info(folder)
    options |= {"fps": int(info["fps"]), "no_video": not any(name.startswith("observation.images.") for name in info["features"])}
    for action in ACTIONS:
        episodes, _ = read_sessions(files, None, options | {"action": action})
        if episodes and new_info(episodes[0])["features"]["action"] == info["features"].get("action"):
            return options | {"action": action}
    return options


def run(words: list[str]) -> int:
    """The command; its exit code. Raises ValueError for bad input."""
    folder, rest = _take_folder(words)
    is_there(folder)  # reports an invalid data set before the arm moves
    code, files = _lead(rest)
    if not files:
        return code
    told = " ".join(map(str, files))
    try:
        episodes, left_out = read_sessions(files, None, _options(folder, files))
        tell_left_out(left_out)
        if not episodes:
            lost = f"; './steadyhand dataset {told} --out DIR' makes one of it in another way" if any("discarded" not in line for line in left_out) else ""
            print(f"{folder}: no episode was kept and whole, it stays as it was{lost}")
            return code
        append(folder, episodes)
    except (ValueError, OSError) as error:
        raise ValueError(f"{folder} stays as it was: {error}; the session is kept, './steadyhand dataset {told} --out DIR' makes another") from None
    return code


def main(words: list[str]) -> int:
    """The command; its exit code."""
    return exit_code(run, words)
