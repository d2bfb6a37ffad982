"""The command `steadyhand` and `python -m steadyhand`: replay, describe and solve, as the program has them."""

import signal
import sys

from . import _native


def main() -> int:
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Python would look for Ctrl-C only after the command
    code, message = _native.run_program(["steadyhand", *sys.argv[1:]])
    if message:
        sys.stderr.write(f"steadyhand: {message}\n")
    return code


if __name__ == "__main__":
    sys.exit(main())
