"""What the package's commands have in common."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from typing import NoReturn


class Parser(argparse.ArgumentParser):
    """Bad arguments are a ValueError, which the command tells as any other bad input."""

    def error(self, message: str) -> NoReturn:
        raise ValueError(message)


def lacks(error: ModuleNotFoundError, extra: str) -> str:
    """What to install, where a package of an extra is missing. Raises the error for any other module."""
    if error.name is None or error.name.split(".")[0] in ("steadyhand", *sys.stdlib_module_names):
        raise error
    return f"{error}; pip install steadyhand[{extra}] brings it"


def exit_code(command: Callable[[list[str]], int], words: list[str]) -> int:
    """That of the command; bad input is told, and is 2."""
    try:
        return command(words)
    except (ValueError, OSError) as error:
        print(f"steadyhand: {error}", file=sys.stderr)
        return 2
