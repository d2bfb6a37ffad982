"""What is built for AArch64, run by qemu: the same plans as those of x86-64.

`./steadyhand test` does not build it: docs/reference/compatibility.md, "AArch64". Natively any build with vectors of 2 numbers
will do; STEADYHAND_CLOSED_LOOP names another.
"""

import json
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from places import PROGRAM, ROOT

NATIVE = Path(os.environ.get("STEADYHAND_CLOSED_LOOP", ROOT / "build/asan/closed_loop"))
FOREIGN = ROOT / "build/aarch64/closed_loop"
EMULATOR = ["qemu-aarch64", "-L", str(ROOT / "build/aarch64-sysroot")]

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(shutil.which(EMULATOR[0]) is None, reason="qemu-user is not installed: setup/apt-aarch64.txt"),
    pytest.mark.skipif(not FOREIGN.exists(), reason="not built: cmake --build build/aarch64 --target closed_loop"),
    pytest.mark.skipif(not NATIVE.exists(), reason="not built: cmake --build build/asan --target closed_loop"),
]


@pytest.fixture(scope="module")
def setup(tmp_path_factory):
    """What both begin with, and the names of its profiles."""
    path = tmp_path_factory.mktemp("aarch64") / "setup.json"
    path.write_text(subprocess.run([PROGRAM, "site-data", "ur5e"], capture_output=True, text=True, check=True).stdout)
    return path, [profile["name"] for profile in json.loads(path.read_text())["profiles"]]


def largest_difference(key, *words):
    """Of any number that the two programs (tests/tools/closed_loop.cpp) print."""
    words = [str(word) for word in words]
    sides = [subprocess.run([*command, *words], capture_output=True, text=True, check=True).stdout
             for command in ([NATIVE], [*EMULATOR, FOREIGN])]
    ours, theirs = (json.loads(side)[key] for side in sides)
    assert [len(row) for row in ours] == [len(row) for row in theirs]
    return max(np.abs(np.subtract(a, b)).max() for a, b in zip(ours, theirs))


PROFILES = 5


@pytest.mark.parametrize("profile", range(PROFILES))
def test_plans_are_those_of_x86(setup, profile):
    """Along random hands, each plan from the one before (rad, rad/s)."""
    path, names = setup
    assert len(names) == PROFILES
    difference = largest_difference("plans", path, profile, 200)
    print(f"{names[profile]}: {difference:.0e}")
    assert difference < 1e-9


def test_commands_of_a_session_are_those_of_x86(setup):
    difference = largest_difference("commands", setup[0], "--play", 5)
    print(f"commands: {difference:.0e}")
    assert difference < 1e-9
