"""The command `steadyhand`, also `python -m steadyhand`. Some commands are written in Python; the program has all others."""

import os
import sys
from importlib import import_module
from pathlib import Path

from ._places import program

PYTHON = {"study": ".study.__main__", "dataset": ".dataset.__main__", "score": ".score.__main__", "policy": ".policies.__main__"}
CHECKOUT = ("bench", "deb", "docs", "format", "python", "release", "site", "test", "wheel")


def main() -> int:
    # The commands of this Python environment are on the path of what is started here: xacro, python.
    os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)])
    command, *words = sys.argv[1:] or [""]
    module = PYTHON.get(command)
    if command == "demo" and any(word.split("=")[0] == "--dataset" for word in words):
        module = ".dataset.live"
    if module is not None:
        return import_module(module, __package__).main(words)
    if command in CHECKOUT:
        print(f"steadyhand: '{command}' needs the sources and compilers: run ./steadyhand {command} in a checkout", file=sys.stderr)
        return 2
    try:
        path = program()
    except FileNotFoundError as error:
        print(f"steadyhand: {error}", file=sys.stderr)
        return 2
    os.execv(path, ["steadyhand", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
