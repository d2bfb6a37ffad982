"""The command `steadyhand` and `python -m steadyhand`: replay, describe and solve, as the program has them, study, dataset, score and policy."""

import signal
import sys

from . import _native
from ._command_line import printable


def main() -> int:
    if sys.argv[1:2] == ["study"]:
        from .study.__main__ import main as study

        return study(sys.argv[2:])
    if sys.argv[1:2] == ["dataset"]:
        from .dataset.__main__ import main as dataset

        return dataset(sys.argv[2:])
    if sys.argv[1:2] == ["score"]:
        from .score.__main__ import main as score

        return score(sys.argv[2:])
    if sys.argv[1:2] == ["policy"]:
        from .policies.__main__ import main as policy

        return policy(sys.argv[2:])
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Python would look for Ctrl-C only after the command
    code, message = _native.run_program(["steadyhand", *sys.argv[1:]])
    if message:
        sys.stderr.write(f"steadyhand: {printable(message)}\n")
    return code


if __name__ == "__main__":
    sys.exit(main())
