"""The gripper of an arm behind ROS 2, before an action server of rclpy (ros2_gripper_peer.py): from a sample of the page to
its goals and back, and what becomes of the arm when that server rejects, gives up, or sleeps."""

import os
import random
import signal
import subprocess
import time

import pytest
from live_client import PROGRAM, Demo
from test_ros2 import CONTROLLER, PATIENT, PEER_PYTHON, Peer, check, needs_rclpy, run

PATIENCE = 60.0  # s
ACTION = "/hand/gripper_cmd"
pytestmark = needs_rclpy


@pytest.fixture(scope="module")
def messages(tmp_path_factory):
    """The folder in which rclpy finds the action's messages."""
    folder = tmp_path_factory.mktemp("control_msgs")
    script = os.path.join(os.path.dirname(__file__), "ros2_control_msgs.py")
    done = subprocess.run([PEER_PYTHON, script, str(folder)], capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-4000:]
    return folder


@pytest.fixture
def domain(monkeypatch):
    number = random.randint(1, 100)
    monkeypatch.setenv("ROS_DOMAIN_ID", str(number))
    return number


class Gripper(Peer):
    def __init__(self, domain, messages, kind="GripperCommand"):
        before = {name: os.environ.get(name) for name in ("PYTHONPATH", "LD_LIBRARY_PATH")}
        os.environ.update(PYTHONPATH=str(messages), LD_LIBRARY_PATH=str(messages))
        try:
            super().__init__(domain, ACTION, kind, script="ros2_gripper_peer.py")
        finally:
            for name, value in before.items():
                os.environ.pop(name) if value is None else os.environ.update({name: value})


def words(*settings):
    return ["--arm", "ros2", "--robot", "ur5e_gripper", "--yes", "--no-recording", "--set", *PATIENT, f"ros2.gripper={ACTION}", *settings]


class Hand:
    """An operator who opens and closes the gripper."""

    def __init__(self, demo):
        self.client = demo.client()
        self.client.send(type="take")

    def wants(self, closed, until, seconds=PATIENCE):
        """Says so until the session's state is as it should be."""
        deadline = time.monotonic() + seconds
        while not until(self.client.state or {}):
            assert time.monotonic() < deadline, self.client.state
            self.client.sample((0, 0, 0), clutch=False, **({} if closed is None else {"gripper": closed}))
            self.client.messages(0.03)

    def is_ready(self):
        self.wants(None, lambda state: state.get("state") == "ready")

    def reset(self):
        """As soon as that is granted: at rest."""
        asked = [0.0]

        def is_ready(state):
            if time.monotonic() > asked[0] + 1.0:
                self.client.send(type="request", kind="reset")
                asked[0] = time.monotonic()
            return state.get("state") == "ready"

        self.wants(None, is_ready)


def gripper_of(state):
    return (state["tools"][0]["gripper"] if state else None) or 0.0


@pytest.mark.parametrize("kind", ["GripperCommand", "ParallelGripperCommand"])
@pytest.mark.long
def test_the_operator_closes_and_opens_it(domain, messages, tmp_path, kind):
    joint = ["knuckle"] if kind == "ParallelGripperCommand" else []
    with run(domain, CONTROLLER, "--rate", "100", "--robot", "ur5e_gripper"), Gripper(domain, messages, kind) as peer:
        demo = Demo(tmp_path, *words("ros2.gripper_effort=7", "ros2.gripper_joint=knuckle"))
        hand = Hand(demo)
        hand.is_ready()
        assert peer.until(lambda told: "goals" in told)["goals"] == []  # nothing moves before it is wanted
        hand.wants(1.0, lambda state: gripper_of(state) > 0.99)
        shown = peer.until(lambda told: "reached" in told.get("ends", []))
        assert shown["position"] == pytest.approx(0.8) and shown["goals"] == [[0.8, 7.0, *joint]]
        hand.wants(0.25, lambda state: abs(gripper_of(state) - 0.25) < 0.01)
        services = [("send_goal", "Request"), ("get_result", "Request"), ("cancel_goal", "Request")]
        asked = [["publishes", f"rq{ACTION}/_action/{name}{part}"] for name, part in services]
        asked += [["subscribes", f"rr{ACTION}/_action/{name}Reply"] for name in ("send_goal", "get_result")]
        asked += [["subscribes", f"rt{ACTION}/_action/{name}"] for name in ("status", "feedback")]
        peer.ask(topics=asked)
        for topic in peer.until(lambda told: "topics" in told)["topics"]:
            hashes = dict(zip(topic["types"], topic["hashes"]))  # feedback is listened to as both kinds
            assert [hashes.get(kind) for kind in topic["expected_types"]] == topic["expected"] and topic["expected"], topic
        peer.ask(object_at=0.5)  # something between the fingers: gripper controllers give up then, and hold it
        hand.wants(1.0, lambda state: abs(gripper_of(state) - 0.625) < 0.01)
        peer.until(lambda told: "stalled" in told.get("ends", []))
        hand.wants(1.0, lambda state, end=time.monotonic() + 1.0: time.monotonic() > end)
        assert hand.client.state["state"] == "ready", hand.client.state
        demo.end()


@pytest.mark.long
def test_one_that_rejects_gives_up_or_sleeps_stops_the_arm(domain, messages, tmp_path):
    with run(domain, CONTROLLER, "--rate", "100", "--robot", "ur5e_gripper"), Gripper(domain, messages) as peer:
        demo = Demo(tmp_path, *words())
        hand = Hand(demo)
        hand.is_ready()
        hand.wants(0.5, lambda state: abs(gripper_of(state) - 0.5) < 0.01)
        peer.ask(rejects=True)
        hand.wants(0.0, lambda state: state.get("state") == "fault")
        assert "rejected a goal" in hand.client.state["reason"] and ACTION in hand.client.state["reason"]
        assert peer.until(lambda told: told.get("position") == pytest.approx(0.4))["goals"] == [[0.4, 20.0]]  # it keeps its grip
        peer.ask(rejects=False)
        hand.reset()
        peer.ask(gives_up=True)
        hand.wants(0.75, lambda state: state.get("state") == "fault")
        assert "gave up a goal" in hand.client.state["reason"]
        peer.ask(gives_up=False)
        hand.reset()
        peer.ask(speed=0.05)  # at full speed it would arrive before a busy machine lets it read the cancellation
        peer.until(lambda told: told.get("speed") == 0.05)
        peer.process.send_signal(signal.SIGSTOP)
        hand.wants(1.0, lambda state: state.get("state") == "fault")
        assert "does not answer" in hand.client.state["reason"]
        peer.process.send_signal(signal.SIGCONT)
        last = peer.until(lambda told: "cancelled" in told.get("ends", []))
        assert last["goals"][-1][0] == pytest.approx(0.8) and last["position"] < 0.7  # it does not do that late
        demo.end()


def test_one_that_is_not_there_is_told_before_anything_moves(domain, tmp_path):
    command = [PROGRAM, "demo", "--no-browser", "--port", "0", "--sessions", str(tmp_path), *words("ros2.start_within=3")]
    with run(domain, CONTROLLER, "--robot", "ur5e_gripper"):
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
        assert done.returncode == 2 and ACTION in done.stderr and "ros2.gripper" in done.stderr, done.stdout + done.stderr
        done = subprocess.run([*command, "ros2.gripper_closed=0"], capture_output=True, text=True, timeout=PATIENCE)
        assert done.returncode == 2 and "ros2.gripper_closed is 0" in done.stderr, done.stderr
        done = check(domain, "--robot", "ur5e_gripper", "--set", f"ros2.gripper={ACTION}")
        assert done.returncode == 1 and f"0 action servers answer for the gripper at {ACTION}" in done.stdout, done.stdout
