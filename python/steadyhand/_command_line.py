"""What the package's commands have in common."""

from __future__ import annotations

import argparse
from typing import NoReturn


class Parser(argparse.ArgumentParser):
    """Bad arguments are a ValueError, which the command tells as any other bad input."""

    def error(self, message: str) -> NoReturn:
        raise ValueError(message)
