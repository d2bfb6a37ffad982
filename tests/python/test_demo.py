"""`steadyhand demo --headless` as a user runs it: threads, summary, signals, bad input. Times are not judged here."""

import os
import re
import signal
import socket
import subprocess
import time

import pytest

from places import PROGRAM


def run(*arguments):
    return subprocess.run([PROGRAM, "demo", *map(str, arguments)], capture_output=True, text=True, timeout=120)


def engaged_seconds(text):
    return float(re.search(r"engaged ([0-9.]+) s", text).group(1))


def test_follows_the_bundled_hand_inside_all_limits():
    result = run("--headless", "--seconds", 6)
    assert result.returncode == 0, result.stderr
    assert engaged_seconds(result.stdout) > 2.0, result.stdout
    looked_at, beyond, contact = map(int, re.search(r"(\d+) looked at, (\d+) beyond a limit, (\d+) in contact", result.stdout).groups())
    assert looked_at > 2000 and beyond == 0 and contact == 0, result.stdout


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_brings_the_arm_to_rest_and_prints_the_summary(number):
    process = subprocess.Popen([PROGRAM, "demo", "--headless"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    time.sleep(4.0)
    process.send_signal(number)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    assert engaged_seconds(out) > 0.0 and "a stop was asked for" in out
    assert " 0 beyond a limit, 0 in contact" in out, out


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["--headless", "--seconds", "-1"], ["--seconds", "-1"]),
        (["--headless", "--rate", "0"], ["rate", "500"]),
        (["--headless", "--rate", "nan"], ["rate", "nan"]),
        (["--headless", "--rate", "501"], ["rate", "501"]),
        (["--headless", "--scale", "0"], ["--scale"]),
        (["--headless", "--speed", "0"], ["--speed is 0", "above 0"]),
        (["--headless", "--hand-on-hardware", "--arm", "ur", "--host", "x", "--keep-going"], ["--keep-going", "simulated"]),
        (["--headless", "--arm", "ur", "--host", "x", "--yes"], ["--headless", "--hand-on-hardware"]),
        (["--keep-going"], ["--keep-going", "--headless"]),
        (["--headless", "--yaw", "inf"], ["--yaw"]),
        (["--headless", "--solver", "magic"], ["magic", "fatrop"]),
        (["--headless", "--profile", "waiterr"], ["waiter"]),
        (["--headless", "--input", "nothing.csv"], ["nothing.csv"]),
        (["--headless", "--robot", "ur6"], ["ur5e"]),
        (["--headless", "--set", "planner.rat=5"], ["planner.rat", "did you mean 'planner.rate'"]),
        (["--headless", "--set", "glass.fill=0.2"], ["glass.fill", "--set", "glass.height", "default"]),
        (["--headless", "--settings", "nothing.yaml"], ["nothing.yaml"]),
        (["--bogus"], ["--bogus"]),
    ],
)
def test_bad_input_ends_with_2_and_says_what_is_wrong(arguments, words):
    result = run(*arguments)
    assert result.returncode == 2, result.stdout + result.stderr
    for word in words:
        assert word in result.stderr, result.stderr


def test_config_prints_settings_that_read_back_with_their_origin(tmp_path):
    config = subprocess.run([PROGRAM, "config", "--rate", "100"], capture_output=True, text=True, timeout=60)
    assert config.returncode == 0, config.stderr
    assert re.search(r"^  rate: 100 .*Hz.*\[--rate\]$", config.stdout, re.MULTILINE), config.stdout
    file = tmp_path / "my.yaml"
    file.write_text(config.stdout)
    again = subprocess.run([PROGRAM, "config", "--settings", str(file)], capture_output=True, text=True, timeout=60)
    assert re.search(rf"^  rate: 100 .*\[{re.escape(str(file))}:\d+\]$", again.stdout, re.MULTILINE), again.stdout
    strip = lambda text: [re.sub(r" *#.*", "", line) for line in text.splitlines()]
    assert strip(config.stdout) == strip(again.stdout)
    demo = run("--headless", "--seconds", 1, "--settings", file, "--no-recording")
    assert demo.returncode == 0 and "at 100 Hz" in demo.stdout, demo.stdout + demo.stderr

    file.write_text("planner:\n  rates: 100\n")
    refused = run("--headless", "--settings", file)
    assert refused.returncode == 2 and f"{file}:2" in refused.stderr and "did you mean 'rate'" in refused.stderr


def test_a_session_that_cannot_begin_leaves_no_recording(tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        result = run("--no-browser", "--port", taken.getsockname()[1], "--sessions", tmp_path)
    assert result.returncode == 2 and "is taken" in result.stderr
    assert not list(tmp_path.iterdir())


def test_descriptors_that_were_closed_are_not_given_to_recordings(tmp_path):
    process = subprocess.Popen([PROGRAM, "demo", "--headless", "--sessions", str(tmp_path)], close_fds=False,
                               preexec_fn=lambda: os.closerange(0, 3))
    try:
        deadline = time.monotonic() + 30.0
        while not list(tmp_path.glob("*.mcap")):
            assert time.monotonic() < deadline and process.poll() is None
            time.sleep(0.1)
        assert [os.readlink(f"/proc/{process.pid}/fd/{number}") for number in range(3)] == ["/dev/null"] * 3
        process.send_signal(signal.SIGINT)
        assert process.wait(30.0) == 2  # its output was discarded
    finally:
        process.kill()
    (path,) = tmp_path.glob("*.mcap")
    listed = subprocess.run([PROGRAM, "report", "--sessions", str(tmp_path)], capture_output=True, text=True, timeout=60)
    assert str(path) in listed.stdout and "cut short" not in listed.stdout
