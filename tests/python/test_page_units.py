"""The page's own unit tests and type check (Vitest and tsc), so that ./steadyhand test runs them too."""

import os
import shutil
import subprocess
from pathlib import Path

from places import ROOT

NODE = shutil.which("node") or shutil.which("nodejs")
PACKAGES = Path(os.environ.get("STEADYHAND_DEPS", ROOT / ".deps")) / "node_modules"


def run(*command):
    done = subprocess.run([NODE, *map(str, command)], cwd=ROOT / "web", capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_types_are_right():
    run(PACKAGES / "typescript" / "bin" / "tsc", "-p", ".")


def test_units():
    assert "passed" in run(PACKAGES / "vitest" / "vitest.mjs", "run")
