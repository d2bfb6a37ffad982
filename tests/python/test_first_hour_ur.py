"""docs/tutorials/ur.md against the fake controller: its commands as they stand there (but shorter), what is seen, and each row
of its table, made so at the fake's pendant and put right again."""

import re
import resource
import signal
import subprocess
import time

import pytest
from places import PROGRAM, ROOT
from test_fake_ur_controller import controller

PAGE = (ROOT / "docs/tutorials/ur.md").read_text()
STEPS = re.findall(r"^## (\d)\. [^\n]*\n```\n(\./steadyhand [^\n]*)\n```\nSeen: ([^\n]*)\n", PAGE, re.MULTILINE)
ROWS = re.findall(r"^\| `([^`]+)` \| [^|]* \| `([^`]+)`, `([^`]+)` \|$", PAGE, re.MULTILINE)
ATTEMPTS = 4  # on a machine that has other things to do, set-points come too late at times


def run(command, address, folder, *more, seconds=2):
    words = re.sub(r"--seconds \d+", f"--seconds {seconds}", command).replace("ADDRESS", address).split()[1:]
    words += ["--yes"] if "--stage" in words or "demo" in words else []
    words += ["--sessions", folder] if "demo" in words else []
    result = subprocess.run([PROGRAM, *words, *more], cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60)
    return result.stdout + result.stderr


def press(process, what):
    process.stdin.write(what + "\n")
    process.stdin.flush()
    assert process.stdout.readline() == f"done: {what}\n"


def test_the_page_has_what_is_tried():
    assert [number for number, _, _ in STEPS] == ["2", "3", "4", "5", "6", "7"]
    assert len(ROWS) == 6


@pytest.mark.long
def test_each_step_shows_what_the_page_says(tmp_path):
    with controller("--calibrated", "--payload", "1.2", "--servo-lag", "0.06") as (address, _):
        for number, command, seen in STEPS:
            words = re.findall(r"`([^`]+)`", seen)
            for _ in range(ATTEMPTS):
                said = run(command, address, str(tmp_path))
                missing = [word for word in words if word not in said]
                if not missing:
                    break
            assert not missing, f"step {number}: {missing} not in\n{said}"
        # The fake's servo lags by 60 ms, twice what the settings say of it.
        delay = float(re.search(r"^  delay: ([\d.]+)", (tmp_path / "my-ur.yaml").read_text(), re.MULTILINE).group(1))
        assert 0.055 < delay < 0.085


@pytest.mark.parametrize(("says", "cause", "cure"), ROWS)
def test_each_row_says_what_the_page_says(tmp_path, says, cause, cure):
    step = next(command for number, command, _ in STEPS if number == "3")
    with controller("--payload", "1.2") as (address, process):
        press(process, cause)
        time.sleep(0.1)
        for _ in range(ATTEMPTS):
            said = run(step, address, str(tmp_path), seconds=1)
            if "no message from the controller" not in said:  # a machine that has other things to do
                break
            time.sleep(0.5)
        assert says in said and "PASSED" not in said.replace("NOT PASSED", ""), said
        press(process, cure)
        time.sleep(0.1)
        for _ in range(ATTEMPTS):
            said = run(step, address, str(tmp_path), seconds=1)
            if "verdict            PASSED" in said:
                return
        pytest.fail(said)


def test_a_protective_stop_is_unlocked_when_the_controller_lets_it(tmp_path):
    command = re.search(r"`(\./steadyhand check[^`]*--unlock-protective-stop)`", PAGE).group(1)
    with controller("--payload", "1.2") as (address, process):
        press(process, "protective")
        time.sleep(0.1)
        said = run(command, address, str(tmp_path))
        assert "Cannot unlock protective stop until 5s" in said and "Protective stop releasing" in said, said


def test_polyscope_x_answers_over_its_robot_api(tmp_path):
    step = next(command for number, command, _ in STEPS if number == "2")
    with controller("--polyscope-x", "--payload", "1.2", "--local") as (address, process):
        said = run(step, address, str(tmp_path), "--dashboard-port", "29999")
        for words in ("software 10.12.0", "robot API          robot mode: RUNNING", "safety mode: NORMAL", "program: PAUSED", "control: LOCAL"):
            assert words in said, said
        press(process, "remote")
        time.sleep(0.1)
        for _ in range(ATTEMPTS):
            said = run(next(command for number, command, _ in STEPS if number == "3"), address, str(tmp_path))
            if "verdict            PASSED" in said:
                return
        pytest.fail(said)


def stage(address, *more, **how):
    words = [PROGRAM, "check", "--host", address, "--yes", *map(str, more)]
    return subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **how)


def test_a_stage_that_is_interrupted_brings_the_arm_to_rest_and_has_not_passed(tmp_path):
    file = tmp_path / "my-ur.yaml"
    with controller("--payload", "1.2") as (address, _):
        for _ in range(ATTEMPTS):
            process = stage(address, "--stage", "empty", "--seconds", "60", "--settings", file)
            time.sleep(3.0)
            process.send_signal(signal.SIGINT)
            asked = time.monotonic()
            said, _ = process.communicate(timeout=60)
            if "interrupted after" in said:
                break
        assert process.returncode == 1, said
        assert re.search(r"NOT PASSED: interrupted after [\d.]+ s$", said, re.MULTILINE), said
        assert not file.exists()
        assert time.monotonic() - asked > 0.5, "it is sent where it is until it stands"


@pytest.mark.parametrize(("before", "after"), [
    ("ur:\n    gain: 500\n", "ur:\n    delay: VALUE\n    gain: 500\n"),
    ("# mine\nur:\n  # of today\n  delay: 0.01\nhand:\n  scale: 1\n", "# mine\nur:\n  # of today\n  delay: VALUE\nhand:\n  scale: 1\n"),
    ("ur: {gain: 500}\n", None),  # beyond it: left as it is
])
def test_what_is_measured_goes_into_any_settings_file_or_leaves_it_alone(tmp_path, before, after):
    file = tmp_path / "my-ur.yaml"
    file.write_text(before)
    with controller("--payload", "1.2") as (address, _):
        for _ in range(ATTEMPTS):
            process = stage(address, "--stage", "slow", "--seconds", "1", "--settings", file)
            said, error = process.communicate(timeout=60)
            if "NOT PASSED" not in said:
                break
    written = re.sub(r"[\d.]+  # measured by steadyhand check", "VALUE", file.read_text())
    if after:
        assert process.returncode == 0 and written == after, said + error
    else:
        assert process.returncode == 2 and written == before and "put delay: 0.0" in error, said + error
    assert [path.name for path in tmp_path.iterdir()] == [file.name]


def test_a_full_disk_does_not_cost_the_settings(tmp_path):
    file = tmp_path / "my-ur.yaml"
    before = "ur:\n  gain: 500\n" + "# words of the user\n" * 100
    file.write_text(before)

    def fill():
        resource.setrlimit(resource.RLIMIT_FSIZE, (500, 500))

    with controller("--payload", "1.2") as (address, _):
        for _ in range(ATTEMPTS):
            process = stage(address, "--stage", "slow", "--seconds", "1", "--settings", file, preexec_fn=fill)
            said, error = process.communicate(timeout=60)
            if "NOT PASSED" not in said:
                break
    assert process.returncode == 2 and "left as it was" in error, said + error
    assert file.read_text() == before


def test_a_stage_takes_ten_minutes_at_most():
    process = stage("127.0.0.1", "--stage", "hold", "--seconds", "86400")
    _, error = process.communicate(timeout=60)
    assert process.returncode == 2 and "600" in error
