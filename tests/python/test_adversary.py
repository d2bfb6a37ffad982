"""The adversary (tests/soak/adversary.py): a minute with seeds that are always the same and with others in each run, and minutes in the long tier."""

import os
import random
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(os.environ.get("STEADYHAND_ROOT", Path(__file__).resolve().parents[2]))


def attack(folder, seconds, seed, **environment):
    return subprocess.run([sys.executable, str(ROOT / "tests/soak/adversary.py"), "--seconds", str(seconds), "--seed", str(seed), "--keep", str(folder)],
                          capture_output=True, text=True, timeout=4 * seconds + 120, env={**os.environ, **environment})


@pytest.mark.parametrize("seconds, seed", [
    pytest.param(30, 101, id="the same seeds"),
    pytest.param(40, None, id="other seeds"),
    pytest.param(300, None, id="minutes", marks=pytest.mark.long),
])
def test_the_judge_finds_no_promise_broken(tmp_path, seconds, seed):
    seed = seed or random.SystemRandom().randrange(1_000, 1_000_000)
    result = attack(tmp_path, seconds, seed)
    assert result.returncode == 0, f"again: adversary.py --seconds {seconds} --seed {seed}\n" + result.stdout[-6000:] + result.stderr[-2000:]


@pytest.mark.long
def test_no_data_race_under_attack(tmp_path):
    """With the program of the preset tsan, which ends with an exit code of its own where it saw a race."""
    program = ROOT / "build/tsan/steadyhand"
    if not program.exists():
        pytest.skip(f"{program} is not built: cmake --preset tsan && cmake --build build/tsan --target steadyhand")
    result = attack(tmp_path, 60, 201, STEADYHAND_PROGRAM=str(program), TSAN_OPTIONS="exitcode=66")
    assert "ThreadSanitizer" not in result.stdout, result.stdout[-6000:]
