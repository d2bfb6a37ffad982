"""The fake Universal Robots controller before an independent client, ur-rtde: it connects, reads, moves and stops the arm.
So what the fake does is not merely what our own client expects."""

import contextlib
import math
import random
import signal
import subprocess
import time
from pathlib import Path

import pytest

from places import PROGRAM

FAKE = str(Path(PROGRAM).parent / "fake_ur_controller")


@contextlib.contextmanager
def controller(*arguments, script_port="30001"):
    """The fake at the usual ports of an address of its own on the loopback."""
    for _ in range(20):
        address = f"127.{random.randint(1, 254)}.{random.randint(1, 254)}.{random.randint(1, 254)}"
        ports = ["--rtde-port", "30004", "--script-port", script_port, "--dashboard-port", "29999"]
        process = subprocess.Popen([FAKE, "--address", address, *ports, *arguments], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        if process.stdout.readline().startswith("listening"):
            break
        process.wait()
    else:
        pytest.fail("no free address")
    try:
        yield address, process
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait(timeout=20)


@pytest.fixture
def ur_rtde():
    pytest.importorskip("rtde_control", reason="ur-rtde is not published for this Python")
    import rtde_control
    import rtde_receive

    return rtde_control, rtde_receive


def wait_until(condition, seconds=30.0):
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.01)
    return condition()


def connect(rtde_control, address, attempts=5):
    """Its patience of 5 s with the controller is a busy machine's no more."""
    for left in reversed(range(attempts)):
        try:
            return rtde_control.RTDEControlInterface(address)
        except RuntimeError:
            if left == 0:
                raise


def away(a, b):
    return max(abs(x - y) for x, y in zip(a, b))


def test_ur_rtde_reads_moves_and_stops_it(ur_rtde):
    rtde_control, rtde_receive = ur_rtde
    with controller("--stopped", script_port="30003") as (address, _):  # where ur-rtde sends its program
        receive = rtde_receive.RTDEReceiveInterface(address)
        assert wait_until(lambda: receive.getTimestamp() > 0.0)
        assert receive.getRobotMode() == 7 and receive.getSafetyMode() == 1
        home = receive.getActualQ()
        control = connect(rtde_control, address)
        assert wait_until(control.isProgramRunning)

        # Each command is repeated until it has an effect: ur-rtde withdraws a command after a cycle or two, so a fake that missed
        # these cycles never sees it.
        goal, end = [q + 0.1 for q in home], [q + 0.106 for q in home]
        at = lambda q, tolerance: away(receive.getTargetQ(), q) < 1e-4 and away(receive.getActualQ(), q) < tolerance
        rests = lambda: max(map(abs, receive.getActualQd())) < 1e-3
        assert wait_until(lambda: at(goal, 1e-3) or (control.moveJ(goal, 1.0, 2.0) and False))

        servo = lambda q: control.servoJ(q, 0.5, 0.5, 0.002, 0.03, 1000)
        for i in range(201):
            period = control.initPeriod()
            servo([q + 0.003 * (1.0 - math.cos(math.pi * i / 200)) for q in goal])  # a small swing: even one step has no jerk
            control.waitPeriod(period)
        assert wait_until(lambda: servo(end) and at(end, 1e-3))
        assert wait_until(lambda: control.servoStop() and rests())

        assert wait_until(lambda: min(receive.getActualQd()) > 0.19 or (control.speedJ([0.2] * 6, 1.0, 0.0) and False))
        assert wait_until(lambda: control.speedStop(5.0) and rests())
        assert wait_until(lambda: not control.isProgramRunning() or control.stopScript())
        control.disconnect()
        receive.disconnect()


def test_check_measures_without_moving():
    with controller() as (address, process):
        result = subprocess.run([PROGRAM, "check", "--host", address, "--seconds", "2"], capture_output=True, text=True, timeout=60)
        # On a busy machine any verdict is possible; then the exit code agrees with it.
        assert result.returncode == (1 if "NOT FIT" in result.stdout else 0), result.stderr
        for words in ("software 5.12.0, RTDE 2, 500 Hz", "Robotmode: RUNNING", "Safetystatus: NORMAL", "round trip", "verdict", "cell               pedestal: the smallest margin is 10 mm"):
            assert words in result.stdout, result.stdout
        process.send_signal(signal.SIGTERM)
        out, _ = process.communicate(timeout=20)
        assert "largest speed 0.000 rad/s" in out


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["check"], ["--host"]),
        (["check", "--arm", "sim", "--host", "x"], ["sim"]),
        (["check", "--host", "127.0.0.1", "--rtde-port", "1", "--seconds", "1"], ["127.0.0.1:1"]),
        (["check", "--host", "127.0.0.1", "--seconds", "0"], ["--seconds", "0"]),
        (["check", "--host", "127.0.0.1", "--seconds", "nan"], ["--seconds", "nan"]),
        (["demo", "--headless", "--hand-on-hardware", "--arm", "ur"], ["--host"]),
        (["demo", "--headless", "--arm", "urr", "--host", "x"], ["urr", "'ur'"]),
        (["demo", "--headless", "--host", "127.0.0.1"], ["--arm ur"]),
        (["demo", "--headless", "--hand-on-hardware", "--arm", "ur", "--host", "127.0.0.1"], ["--yes"]),
        (["demo", "--headless", "--hand-on-hardware", "--arm", "ur", "--host", "127.0.0.1", "--speed", "2"], ["--speed", "2"]),
        (["check", "--host", "127.0.0.1", "--stage", "slwo"], ["--stage", "slwo", "slow"]),
        (["check", "--host", "127.0.0.1", "--stage", "slow"], ["--yes"]),
        (["demo", "--headless", "--hand-on-hardware", "--arm", "ur", "--host", "127.0.0.1", "--script-port", "1", "--yes"], ["127.0.0.1:1", "Services"]),
    ],
)
def test_bad_input_ends_with_2_and_says_what_is_wrong(arguments, words):
    result = subprocess.run([PROGRAM, *arguments], stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60)
    assert result.returncode == 2, result.stdout + result.stderr
    for word in words:
        assert word in result.stderr, result.stderr


@pytest.mark.parametrize(
    "arguments, said",
    [
        ([], "at 25 % of its speed and acceleration.\n"),
        (["--speed", "1"], "at 100 % of its speed and acceleration, at 25 % until the first engagement after 10 s of following.\n"),
        (["--speed", "1", "--set", "arm.first_moves=0"], "at 100 % of its speed and acceleration.\n"),
    ],
)
def test_it_says_how_fast_the_arm_will_move(arguments, said):
    command = [PROGRAM, "demo", "--headless", "--hand-on-hardware", "--arm", "ur", "--host", "127.0.0.1", *arguments]
    result = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60)
    assert result.returncode == 2 and said in result.stdout, result.stdout + result.stderr


def test_demo_drives_it_and_leaves_it_at_rest(tmp_path):
    with controller() as (address, process):
        arguments = ["--headless", "--hand-on-hardware", "--seconds", "5", "--arm", "ur", "--host", address, "--yes", "--sessions", tmp_path]
        result = subprocess.run([PROGRAM, "demo", *arguments], capture_output=True, text=True, timeout=120)
        # On a busy machine the arm may stop for want of set-points, which ends the program. Or the program missed more cycles
        # than the controller bridges at a quarter of the acceleration, which is reported and stops it.
        stopped = "ended because the arm was stopped" in result.stdout
        assert result.returncode == 0 or stopped, result.stderr
        assert "will MOVE" in result.stdout and "Universal Robots, software 5.12.0" in result.stdout, result.stdout
        away = stopped and "a command is beyond an acceleration limit" in result.stdout and " 0 deadlines missed" not in result.stdout
        assert away or " 0 beyond a limit, 0 in contact" in result.stdout, result.stdout
        process.send_signal(signal.SIGTERM)
        out, _ = process.communicate(timeout=20)
        speed = float(out.split("largest speed ")[1].split()[0])
        assert speed < 0.9, out  # a quarter of pi rad/s
        # On a machine that is busy with other things the arm may stop for want of set-points before it moves.
        if "set-points stopped" not in result.stdout and "no message" not in result.stdout:
            assert speed > 0.05, result.stdout + out
