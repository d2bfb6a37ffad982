"""The command `steadyhand policy` (docs/how-to/policies.md)."""

from __future__ import annotations

import importlib.util
import signal
import sys
from pathlib import Path
from typing import Any

from .._command_line import Parser, printable
from ._live import lead


def _parser() -> Parser:
    parser = Parser(
        prog="steadyhand policy",
        description="Runs a policy of a Python file. It controls the arm of the running session, in turns with a person (docs/how-to/policies.md).",
        epilog="Exit codes: 0 the policy ended or was interrupted; 1 the session ended; 2 bad input, with the reason on stderr.",
        allow_abbrev=False,
    )
    parser.add_argument("policy", metavar="FILE.py:CLASS", help="class or function of this file that makes the policy")
    parser.add_argument("arguments", nargs="*", metavar="ARG", help="its arguments, as text")
    parser.add_argument("--port", type=int, default=8642, metavar="N", help="port of the program's page (8642)")
    parser.add_argument("--turn", action="store_true", help="take control if no client has it, and start the policy's turn; by default a person does so at the page")
    parser.add_argument("--seconds", type=float, metavar="S", help="end after this time, s")
    return parser


def _make(word: str, arguments: list[str]) -> Any:
    path, _, name = word.rpartition(":")
    if not path or not name:
        raise ValueError(f"'{word}' must be FILE.py:CLASS")
    file = Path(path)
    if not file.is_file():
        raise ValueError(f"{file}: there is no such file")
    spec = importlib.util.spec_from_file_location(file.stem, file)
    if spec is None or spec.loader is None:
        raise ValueError(f"{file}: is no Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[file.stem] = module
    sys.path.insert(0, str(file.parent))
    spec.loader.exec_module(module)
    if not hasattr(module, name):
        raise ValueError(f"{file}: has no '{name}'")
    policy = getattr(module, name)(*arguments)
    for member in ("period", "act"):
        if not hasattr(policy, member):
            raise ValueError(f"{file}: what '{name}' makes has no '{member}'; a policy has period and act(observation)")
    if not 0.004 <= float(policy.period) <= 0.5:
        raise ValueError(f"{file}: the policy's period is {policy.period} s; it must be from 0.004 to 0.5")
    return policy


def main(words: list[str]) -> int:
    """With the arguments of the command."""
    try:
        options = _parser().parse_args(words)
        policy = _make(options.policy, options.arguments)
    except (ValueError, OSError, SyntaxError, ImportError, TypeError) as error:
        sys.stderr.write(f"steadyhand: {printable(str(error))}\n")
        return 2
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell may start background jobs with SIGINT ignored
    try:
        lead(policy, options.port, name=options.policy.rpartition(":")[2], turn=options.turn, seconds=options.seconds)
    except ConnectionError as error:
        sys.stderr.write(f"steadyhand: {printable(str(error))}\n")
        return 1
    except KeyboardInterrupt:
        pass
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
