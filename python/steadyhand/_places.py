"""Where the program and the library find packages of the Python environment, and where the program is."""

import os
import shutil
import sys
from pathlib import Path

# Python packages with URDFs, meshes and libraries: read by the native code and by every program that is started from here.
_folders = [os.environ.get("STEADYHAND_PACKAGES", ""), *(path for path in sys.path if Path(path).name in ("site-packages", "dist-packages"))]
os.environ["STEADYHAND_PACKAGES"] = os.pathsep.join(dict.fromkeys(filter(None, _folders)))


def program() -> str:
    """Path of the program: of STEADYHAND_PROGRAM, in this package, or on PATH. Raises FileNotFoundError if there is none."""
    named = os.environ.get("STEADYHAND_PROGRAM")
    if named and not os.path.exists(named):
        raise FileNotFoundError(f"STEADYHAND_PROGRAM is '{named}': no such file")
    for path in filter(None, (named, Path(__file__).with_name("bin") / "steadyhand", shutil.which("steadyhand"))):
        if os.path.exists(path) and Path(path).resolve() != Path(sys.argv[0]).resolve():  # not the script of this package
            return str(path)
    raise FileNotFoundError("this installation has the library alone; a wheel made by ./steadyhand wheel also has the program")
