"""The adversary (tests/soak/adversary.py): half a minute with seeds that are always the same; others, and minutes, in the long tier."""

import os
import random
import re
import subprocess
import sys

import pytest

from places import ROOT


def attack(folder, seconds, seed, **environment):
    return subprocess.run([sys.executable, str(ROOT / "tests/soak/adversary.py"), "--seconds", str(seconds), "--seed", str(seed), "--keep", str(folder)],
                          capture_output=True, text=True, timeout=4 * seconds + 120, env={**os.environ, **environment})


@pytest.mark.parametrize("seconds, seed", [
    pytest.param(30, 101, id="the same seeds"),
    pytest.param(40, None, id="other seeds", marks=pytest.mark.long),
    pytest.param(300, None, id="minutes", marks=pytest.mark.long),
])
def test_the_judge_finds_no_promise_broken(tmp_path, seconds, seed):
    seed = seed or random.SystemRandom().randrange(1_000, 1_000_000)
    result = attack(tmp_path, seconds, seed)
    assert result.returncode == 0, f"again: adversary.py --seconds {seconds} --seed {seed}\n" + result.stdout[-6000:] + result.stderr[-2000:]


@pytest.mark.long
def test_no_data_race_under_attack(tmp_path):
    """With the program of the preset tsan. It is too slow to keep promises about time: the judge's words do not count here."""
    program = ROOT / "build/tsan/steadyhand"
    if not program.exists():
        pytest.skip(f"{program} is not built: cmake --preset tsan && cmake --build build/tsan --target steadyhand")
    races = tmp_path / "race"  # and the process; not on stdout, which the adversary does not always read
    result = attack(tmp_path / "sessions", 70, 201, STEADYHAND_PROGRAM=str(program), TSAN_OPTIONS=f"log_path={races}:exitcode=66")
    found = "".join(file.read_text() for file in sorted(tmp_path.glob("race.*")))
    assert not found, found[:12000]
    counts = dict(line.rsplit(maxsplit=1) for line in result.stdout.splitlines() if re.fullmatch(r"[a-z].* \d+", line))
    assert int(counts["commands"]) > 5000 and int(counts["samples"]) > 100, result.stdout[-6000:] + result.stderr[-2000:]
