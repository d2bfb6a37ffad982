"""Functions that all commands of the package use."""

from __future__ import annotations

import argparse
import contextlib
import re
import sys
from collections.abc import Callable
from typing import Any, NoReturn

_CONTROLS = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")


def printable(text: str) -> str:
    r"""The text as a terminal may have it: control characters, except line ends and tabs, and characters that change the direction of the text
    are written as \x1b."""
    return _CONTROLS.sub(lambda found: "".join(f"\\x{byte:02x}" for byte in found[0].encode()), text)


class Shown:
    """A stream whose texts are printable. Names of files, and what is in them, must not command the user's terminal."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        self._stream.write(printable(text))
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


class Parser(argparse.ArgumentParser):
    """Bad arguments are a ValueError, which the command reports like other bad input."""

    def error(self, message: str) -> NoReturn:
        raise ValueError(message)


def lacks(error: ModuleNotFoundError, extra: str) -> str:
    """What to install, where a package of an extra is missing. Raises the error for any other module."""
    if error.name is None or error.name.split(".")[0] in ("steadyhand", *sys.stdlib_module_names):
        raise error
    return f"{error}; the extra [{extra}] of the package installs it: pip install 'FILE.whl[{extra}]'"


def exit_code(command: Callable[[list[str]], int], words: list[str]) -> int:
    """The exit code of the command; bad input is printed to stderr and returns 2."""
    with contextlib.redirect_stdout(Shown(sys.stdout)), contextlib.redirect_stderr(Shown(sys.stderr)):
        try:
            return command(words)
        except (ValueError, OSError) as error:
            print(f"steadyhand: {error}", file=sys.stderr)
            return 2
