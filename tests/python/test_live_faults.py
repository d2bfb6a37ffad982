"""What operators and networks do to a live session, over real WebSockets. Each test is a row of docs/reference/safety.md."""

import fcntl
import json
import math
import os
import pty
import re
import select
import signal
import subprocess
import sys
import termios
import time

import pytest
from mcap.reader import make_reader

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
        client.stay()
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
    target = commands[0]["tools"][0]["target"]["p"]
    assert all(math.dist(s["tools"][0]["target"]["p"], target) < 0.05 for s in commands), "the other's hand moved the target"
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


def test_a_stop_beside_a_reset_wins_and_stays(demo):
    operator, other = demo.client(), demo.client(pair=False)
    operator.grip()
    operator.send(type="request", kind="stop")
    operator.wait_for("state", state="stopping")
    states = set()
    for i in range(20):
        operator.wait_for("state", state="stopping")
        still(operator, 0.05)
        operator.send(type="request", kind="reset")
        (operator if i % 2 else other).send(type="request", kind="stop")
        operator.move(hand, 0.2, each=lambda s: states.add(s["state"]))
        assert i % 2 == 0 or operator.state["state"] == "stopping", i
        wait_until(operator, lambda s: s["state"] == "stopping")  # two sockets have no order among them
    assert "engaged" not in states
    deadline = time.monotonic() + 30.0
    while operator.state["state"] != "ready":  # a reset that comes after the stop was seen counts
        assert time.monotonic() < deadline, operator.state
        operator.send(type="request", kind="reset")
        operator.move(hand, 0.1)
    operator.grip(take=False)


def plays(client):
    return client.state["controls"]["playback"] >= 0


def wait_until(client, condition, seconds=30.0):
    deadline = time.monotonic() + seconds
    while client.state is None or not condition(client.state):
        assert time.monotonic() < deadline and not client.closed, (client.state, client.state and client.state["controls"])
        client.messages(0.05)
        client.stay()


def begin_playback(client):
    """Takes the lease, anew if need be, and lets a recorded hand lead, until the arm follows it."""
    client.send(type="release")
    client.send(type="take")
    client.wait_for("lease", yours=True)
    wait_until(client, lambda s: s["state"] == "ready" and s["controls"]["playback"] < 0)
    client.send(type="request", kind="playback", text="carrying")
    wait_until(client, lambda s: s["state"] == "engaged" and max(map(abs, s["command"])) > 0)


def expect_rest_without_playback(watcher, state):
    wait_until(watcher, lambda s: s["state"] == state and s["controls"]["playback"] < 0)
    still(watcher, 1.5)  # coming to rest
    assert still(watcher, 2.5), "beyond the pause of a recording"  # which begins a round after 1 s
    assert watcher.state["state"] == state and not plays(watcher)


@pytest.mark.parametrize("how", ["killed", "given back", "silent"])
def test_a_recorded_hand_ends_with_the_lease_of_who_began_it(demo, how):
    watcher, operator = demo.client(pair=False), demo.client()
    begin_playback(operator)
    if how == "killed":
        operator.socket.close()
    elif how == "given back":
        operator.send(type="release")
    expect_rest_without_playback(watcher, "ready")


def test_a_recorded_hand_ends_with_a_stop_and_a_reset_does_not_bring_it_back(demo):
    operator, other = demo.client(), demo.client(pair=False)
    begin_playback(operator)
    other.send(type="request", kind="stop")
    expect_rest_without_playback(operator, "stopping")
    operator.send(type="request", kind="playback", text="carrying")  # refused while the arm is stopped
    operator.send(type="request", kind="reset")
    expect_rest_without_playback(operator, "ready")
    begin_playback(operator)


def test_the_first_lease_ends_the_recorded_hand_of_the_terminal(demo):
    client = demo.client()
    wait_until(client, lambda s: s["state"] == "engaged" and s["controls"]["playback"] >= 0)
    client.send(type="take")
    client.wait_for("lease", yours=True)
    expect_rest_without_playback(client, "ready")
    client.send(type="release")
    expect_rest_without_playback(client, "ready")


def headless(folder, *arguments):
    process = subprocess.Popen([PROGRAM, "demo", "--headless", "--sessions", str(folder), *arguments],
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert "Hz" in process.stdout.readline()  # from here on signals are waited for
    return process


def sleep_through(process, seconds):
    process.send_signal(signal.SIGSTOP)
    time.sleep(seconds)
    process.send_signal(signal.SIGCONT)


def test_without_a_page_the_program_ends_when_the_arm_is_stopped(tmp_path):
    process = headless(tmp_path)
    time.sleep(2.0)
    sleep_through(process, 0.3)
    out, err = process.communicate(timeout=30)
    assert process.returncode == 1 and "ended because the arm was stopped" in out, out + err

    process = headless(tmp_path, "--keep-going")
    time.sleep(2.0)
    for _ in range(2):
        sleep_through(process, 0.3)
        time.sleep(3.0)
        assert process.poll() is None
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=30)
    assert process.returncode == 0, out + err
    assert int(re.search(r"in (\d+) engagements", out).group(1)) >= 2, out


class FullPipe:
    """A pipe that nobody reads, once it is closed for good."""

    def __init__(self):
        self.read, self.write = os.pipe()
        fcntl.fcntl(self.read, 1031, 4096)  # F_SETPIPE_SZ

    def fill(self):
        with open(f"/proc/self/fd/{self.write}", "wb", buffering=0, opener=lambda p, f: os.open(p, f | os.O_NONBLOCK)) as end:
            for size in (4096, 1):
                try:
                    while end.write(b" " * size):
                        pass
                except BlockingIOError:
                    pass

    def lines_until(self, pattern):
        text = ""
        while not (found := re.search(pattern, text)):
            text += os.read(self.read, 4096).decode()
        return found


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_nobody_who_reads_what_is_printed_is_waited_for(tmp_path, number):
    pipe = FullPipe()
    process = subprocess.Popen([PROGRAM, "demo", "--no-browser", "--port", "0", "--sessions", str(tmp_path)],
                               stdout=pipe.write, stderr=pipe.write)
    try:
        port, code = pipe.lines_until(r"open +http://[^:]+:(\d+)/#(?:\w+=)?(\w+)\n").groups()
        pipe.fill()
        operator = Client(int(port))
        operator.send(type="pair", code=code)  # prints the next one
        operator.wait_for("paired")
        operator.send(type="take")
        for _ in range(50):  # each prints why it is refused
            operator.send(type="request", kind="rate", value=5.0)
        begin_playback(operator)
        newcomer = Client(int(port))
        newcomer.wait_for("welcome")
        newcomer.send(type="request", kind="stop")
        asked = time.monotonic()
        newcomer.wait_for("state", state="stopping")
        assert time.monotonic() - asked < 5.0
        expect_rest_without_playback(newcomer, "stopping")
        process.send_signal(number)
        process.wait(60.0)
    finally:
        process.kill()
        process.wait()
    (path,) = tmp_path.glob("*.mcap")
    listed = subprocess.run([PROGRAM, "report", "--sessions", str(tmp_path)], capture_output=True, text=True)
    assert str(path) in listed.stdout and "cut short" not in listed.stdout


def commands_of(path):
    """Times, s, and joint speeds of the commands of a session that is complete."""
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True)
        assert reader.get_summary() is not None and any(m.name == "summary" for m in reader.iter_metadata())
        for _, _, message in reader.iter_messages(topics=["/joint_command"]):
            yield 1e-9 * message.log_time, json.loads(message.data)["dq"]


@pytest.mark.parametrize("after, again", [(0.0, False), (0.1, True), (0.6, False), (1.2, True), (2.3, False)])
def test_ctrl_c_at_any_moment_ends_in_order(tmp_path, after, again):
    process = headless(tmp_path)
    time.sleep(after)
    process.send_signal(signal.SIGINT)
    asked = time.monotonic()
    if again:
        time.sleep(0.05)
        process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    assert " 0 beyond a limit, 0 in contact" in out and "recorded: " in out, out
    assert time.monotonic() - asked < 10.0
    (path,) = tmp_path.glob("*.mcap")
    commands = list(commands_of(path))
    assert commands or after < 0.2, "the arm was led"
    assert not commands or max(map(abs, commands[-1][1])) < 1e-9, "at rest"
    assert after < 2.0 or any(max(map(abs, dq)) > 0.05 for _, dq in commands), "there was motion to end"


def test_a_terminal_that_halts_who_writes_from_the_background_does_not_halt_it(tmp_path):
    master, slave = pty.openpty()
    attributes = termios.tcgetattr(slave)
    attributes[3] |= termios.TOSTOP
    termios.tcsetattr(slave, termios.TCSANOW, attributes)
    in_background = ("import fcntl, os, subprocess, sys, termios\nfcntl.ioctl(0, termios.TIOCSCTTY, 0)\n"
                     "sys.exit(subprocess.call(sys.argv[1:], preexec_fn=os.setpgrp))")
    process = subprocess.Popen([sys.executable, "-c", in_background, PROGRAM, "demo", "--headless", "--seconds", "1", "--sessions", str(tmp_path)],
                               stdin=slave, stdout=slave, stderr=slave, start_new_session=True)
    try:
        assert process.wait(30.0) == 0
        text = b""
        while b"hand to command" not in text:  # a read returns what is there, which may be a line
            assert select.select([master], [], [], 5.0)[0], text
            text += os.read(master, 65536)
    finally:
        process.kill()
        os.close(master)  # which ends what is left there
        os.close(slave)
