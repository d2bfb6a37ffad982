"""Where the program and the library find what pip installed beside them."""

import os
import shutil
import sys
from pathlib import Path

# Python packages with URDFs, meshes and libraries: read by the native code and by every program that is started from here.
_folders = [os.environ.get("STEADYHAND_PACKAGES", ""), *(path for path in sys.path if Path(path).name in ("site-packages", "dist-packages"))]
os.environ["STEADYHAND_PACKAGES"] = os.pathsep.join(dict.fromkeys(filter(None, _folders)))


def program() -> str:
    """Path of the program: of STEADYHAND_PROGRAM, of this package, or on PATH. Raises FileNotFoundError if there is none."""
    inside = Path(__file__).with_name("bin") / "steadyhand"
    if named := os.environ.get("STEADYHAND_PROGRAM"):
        return named
    if inside.exists():
        return str(inside)
    found = shutil.which("steadyhand")
    if found is None or open(found, "rb").read(2) == b"#!":  # the script of this very package
        raise FileNotFoundError("this installation has the library alone; a wheel made by ./steadyhand wheel also has the program")
    return found
