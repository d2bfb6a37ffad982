"""What operators and networks do to a live session, over real WebSockets. Each test is a row of docs/safety.md."""

import math
import signal
import subprocess
import time

import pytest

from live_client import PROGRAM, Client, Demo


def hand(t):
    return 0.1 * math.sin(2.0 * t), 0.05 * math.sin(1.3 * t), 0.0


@pytest.fixture()
def demo(tmp_path):
    demo = Demo(tmp_path, "--scale", 1, "--yaw", 0)
    yield demo
    text = demo.end()
    assert " 0 beyond a limit, 0 in contact" in text, text


def still(client, seconds=1.0):
    """Nothing is commanded to move."""
    commands = []
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        commands += [m["command"] for m in client.messages(0.05) if m["type"] == "state"]
    return max((abs(a - b) for c in commands[1:] for a, b in zip(c, commands[0])), default=1.0) < 1e-9


def test_a_client_that_dies_mid_grip_leaves_the_arm_at_rest(demo):
    watcher, operator = demo.client(pair=False), demo.client()
    operator.grip()
    operator.move(hand, 1.0)
    operator.socket.close()
    deadline = time.monotonic() + 30.0
    while not (still(watcher) and watcher.state["state"] == "ready"):
        assert time.monotonic() < deadline, watcher.state

    second = demo.client()
    second.send(type="take")
    second.wait_for("lease", yours=True)
    second.move(hand, 0.5)  # its clutch is closed already: no fresh grip
    assert still(second)
    second.grip(take=False)


def test_of_two_clients_that_want_to_command_one_does(demo):
    first, second = demo.client(), demo.client()
    first.grip()
    commands = []
    for i in range(10):
        second.send(type="take")
        second.wait_for("error", code="taken")
        second.sample((0.5, 0.5, 0.5), True)
        first.move(lambda t: (0, 0, 0), 0.1, each=lambda s: commands.append(s))
    target = commands[0]["target"]["p"]
    assert all(math.dist(s["target"]["p"], target) < 0.05 for s in commands), "the other's hand moved the target"
    second.send(type="request", kind="stop")  # anybody may stop
    second.wait_for("state", state="stopping")


def test_a_client_of_another_version_is_turned_away(demo):
    client = Client(demo.port, version=999)
    assert client.wait_for("error")["code"] == "version"
    deadline = time.monotonic() + 30.0
    while not client.closed:
        assert time.monotonic() < deadline
        client.messages(0.1)
    demo.client().grip()


def test_a_client_that_floods_is_cut_off(demo):
    flooder = demo.client(pair=False)
    told = []
    end = time.monotonic() + 10.0  # beyond any slow machine, and less than the server's patience with the silent
    try:
        while time.monotonic() < end and not flooder.closed:
            for _ in range(100):
                flooder.ping()
            told += [m["code"] for m in flooder.messages() if m["type"] == "error"]
    except ConnectionError:  # not a time-out: those that read slowly are not meant
        flooder.closed = True
    assert flooder.closed and "too_many" in told


def test_who_asks_gets_the_arm_when_its_holder_lets_go_and_stays_silent(demo):
    first, second = demo.client(), demo.client()
    first.grip()
    second.send(type="ask")
    assert first.wait_for("lease", yours=True)["asker"] != 0
    leases = []

    def listen(_=None):
        second.ping()
        leases.extend(m for m in second.messages() if m["type"] == "lease")

    begin = time.monotonic()
    while time.monotonic() < begin + 12.0:
        first.grip(take=False)  # whenever this machine was too busy to send, the arm was let go
        first.move(hand, 2.0, each=listen)
    assert leases[-1]["asker"] != 0 and not leases[-1]["yours"], "while it leads the arm it keeps it"
    first.sample(hand(12.0), False)
    begin = time.monotonic()
    while not leases[-1]["yours"]:
        assert time.monotonic() < begin + 30.0
        first.ping()
        first.messages(0.2)
        listen()
    assert time.monotonic() - begin >= 9.9
    assert still(second)
    second.grip(take=False)


def test_a_stop_beside_a_reset_wins_and_stays(demo):
    operator, other = demo.client(), demo.client(pair=False)
    operator.grip()
    operator.send(type="request", kind="stop")
    for i in range(20):
        operator.wait_for("state", state="stopping")
        still(operator, 0.05)
        operator.send(type="request", kind="reset")
        (operator if i % 2 else other).send(type="request", kind="stop")
        operator.move(hand, 0.2)
        assert operator.state["state"] == "stopping", i
    deadline = time.monotonic() + 30.0
    while operator.state["state"] != "ready":  # a reset that comes after the stop was seen counts
        assert time.monotonic() < deadline, operator.state
        operator.send(type="request", kind="reset")
        operator.move(hand, 0.1)
    operator.grip(take=False)


@pytest.mark.parametrize("after, again", [(0.0, False), (0.1, True), (0.6, False), (1.2, True), (2.3, False)])
def test_ctrl_c_at_any_moment_ends_in_order(tmp_path, after, again):
    process = subprocess.Popen([PROGRAM, "demo", "--headless", "--sessions", str(tmp_path)],
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert "Hz" in process.stdout.readline()  # from here on signals are waited for
    time.sleep(after)
    process.send_signal(signal.SIGINT)
    if again:
        time.sleep(0.05)
        process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    assert " 0 beyond a limit, 0 in contact" in out and "recorded: " in out, out
