"""Makes packages that others install, in FOLDER or dist/, and prints their paths.

    python3 setup/package.py wheel|deb [FOLDER]

wheel: program and Python package, for every Linux whose glibc is not older than its name says. PYTHON names the Python that it is
for, and if that is 3.12 or newer also every later one; by default that of .deps/venv. deb: the program, and libsteadyhand-dev.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import build
from install import ROOT, VENV, call, end, locked, run, say

PYTHON = VENV / "bin/python"


def make_wheel(folder):
    path = {**os.environ, "PATH": f"{VENV}/bin:{os.environ['PATH']}"}
    with tempfile.TemporaryDirectory(dir=folder) as built:
        command = ["-m", "pip", "wheel", "--quiet", "--disable-pip-version-check", "--no-deps", "--wheel-dir", built, ROOT]
        if not run(os.environ.get("PYTHON", PYTHON), *command, env={**os.environ, "STEADYHAND_WHEEL": "1"}):
            end(1, "pip could not build the wheel (its words are above)")
        [wheel] = Path(built).glob("*.whl")
        repaired = Path(built) / "repaired"
        done = subprocess.run([PYTHON, "-m", "auditwheel", "repair", "--wheel-dir", repaired, wheel], env=path, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        if done.returncode:
            end(1, f"auditwheel could not repair the wheel:\n{done.stdout}")
        return [each.replace(folder / each.name) for each in repaired.iterdir()]


def make_deb(folder):
    build.main("package", "all")
    with tempfile.TemporaryDirectory(dir=folder) as built:
        if not run("cpack", "--config", ROOT / "build/package/CPackConfig.cmake", "-B", built):
            end(1, "CPack could not make the packages (its words are above)")
        return [each.replace(folder / each.name) for each in Path(built).glob("*.deb")]


def main(kind="", folder=ROOT / "dist", *more):
    makers = {"wheel": make_wheel, "deb": make_deb}
    if kind not in makers or more:
        end(2, f"package.py takes wheel or deb and a folder, not '{' '.join(sys.argv[1:])}'")
    folder = Path(folder).absolute()
    folder.mkdir(parents=True, exist_ok=True)
    with locked(ROOT / f"build/{kind}.lock"):
        say(f"building the packages in {folder}")
        for path in makers[kind](folder):
            print(path)


if __name__ == "__main__":
    call(main, *sys.argv[1:])
