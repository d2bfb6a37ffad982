"""The ROS 2 side before ROS 2's own rclpy (ros2_peer.py, a process of its own): as the arm and its controller, as a hand,
and as RViz would listen; each message of the program's goes over the wire with every field filled. What rclpy has no
message for, the controller's state, comes from PyPI's cyclonedds as Humble and as Jazzy lay it out."""

import contextlib
import json
import math
import os
import queue
import random
import re
import signal
import subprocess
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from places import PROGRAM, ROOT

CONTROLLER = str(Path(PROGRAM).parent / "reference_controller")
ECHO = str(Path(PROGRAM).parent / "ros2_echo")
PEER_PYTHON = os.environ.get("STEADYHAND_ROS2_PYTHON", str(ROOT / ".deps/ros2/bin/python"))
if not Path(CONTROLLER).exists():
    pytest.skip("built without ROS 2: no Cyclone DDS here", allow_module_level=True)
needs_rclpy = pytest.mark.skipif(
    not Path(PEER_PYTHON).exists(), reason="NOT TESTED against rclpy: it is published for Python 3.11 only, not here"
)
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"  # on this computer, by unicast: containers seldom have multicast
for name in ("CYCLONEDDS_URI", "ROS_STATIC_PEERS", "ROS_LOCALHOST_ONLY"):
    os.environ.pop(name, None)
NO_MULTICAST = "<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast></General></Domain></CycloneDDS>"
# As rmw_cyclonedds configures it, for PyPI's cyclonedds.
NEIGHBOURS = (
    "<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast></General><Discovery>"
    "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>"
    "<Peers><Peer address='127.0.0.1'/></Peers></Discovery></Domain></CycloneDDS>"
)
JOINTS = [f"{name}_joint" for name in ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")]
HOME = [0.4, -1.3, 1.6, 0.4, 0.4, 0.4]  # the peer's arm
# For Python: fewer cycles, and the longest timeouts for the network and for missed cycles that can be set. Stops because of the
# arm's position are unchanged. A longer stall still stops it, so tests that move an arm are in the long tier.
PATIENT = ["ros2.control_rate=100", "ros2.rate=20", "ros2.look_ahead=0.5", "ros2.state_timeout=0.44", "ros2.start_within=40", "control.stall_cycles=1000"]


@pytest.fixture
def domain():
    return random.randint(1, 100)


@contextlib.contextmanager
def run(domain, *command, environment=None, **options):
    environment = {**(environment or os.environ), "ROS_DOMAIN_ID": str(domain), "PYTHONUNBUFFERED": "1"}
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment, **options
    )
    try:
        yield process
    finally:
        process.send_signal(signal.SIGTERM)
        try:
            print(process.communicate(timeout=40)[0])  # to be seen if the test fails
        except ValueError:  # the test has read it
            pass
        except subprocess.TimeoutExpired:
            process.kill()


def demo(domain, folder, *settings, input=None):
    command = [PROGRAM, "demo", "--arm", "ros2", "--headless", "--hand-on-hardware", "--yes", "--rate", "20", "--sessions", str(folder)]
    if input:
        command += ["--input", str(input)]
    return run(domain, *command, "--seconds", "120", "--set", *PATIENT, *settings)


class Peer:
    """ros2_peer.py, or another program of rclpy, and what it told."""

    def __init__(self, domain, *arguments, script="ros2_peer.py"):
        environment = {
            **os.environ,
            "ROS_DOMAIN_ID": str(domain),
            "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
            "ROS_LOG_DIR": os.environ["XDG_DATA_HOME"],
        }
        path = str(Path(__file__).with_name(script))
        self.process = subprocess.Popen(
            [PEER_PYTHON, path, *arguments], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment
        )
        self.beside = None  # a program without which nothing good will come
        self.lines = queue.Queue()
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        for line in self.process.stdout:
            self.lines.put(json.loads(line))
        self.lines.put(None)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.communicate()

    def ask(self, **order):
        self.process.stdin.write(json.dumps(order) + "\n")
        self.process.stdin.flush()

    def until_it_stands(self):
        """The first words after a second without motion."""
        last = []

        def stands(words):
            last.append(words.get("moved", math.nan))
            return len(last) > 10 and max(last[-10:]) - min(last[-10:]) < 1e-6

        return self.until(stands)

    def until(self, good, seconds=60.0):
        """The first words that are good."""
        end, words = time.monotonic() + seconds, None
        while time.monotonic() < end and (self.beside is None or self.beside.poll() is None):
            with contextlib.suppress(queue.Empty):
                words = self.lines.get(timeout=1.0)
                if words is None:
                    break
                if good(words):
                    return words
        raise AssertionError(f"the peer did not come to tell that; the last that it told: {words}")


@contextlib.contextmanager
def controller_states(domain, controller, layout):
    """Publishes that the controller is active, as that distribution lays it out: they agree on how it begins."""
    cyclonedds = pytest.importorskip("cyclonedds.domain", reason="cyclonedds is not published for this Python")
    from cyclonedds.idl import IdlStruct
    from cyclonedds.idl.types import float64, int32, sequence, uint32
    from cyclonedds.pub import DataWriter
    from cyclonedds.topic import Topic

    @dataclass
    class Stamp(IdlStruct):
        sec: int32 = 0
        nanosec: uint32 = 0

    @dataclass
    class Header(IdlStruct):
        stamp: Stamp = field(default_factory=Stamp)
        frame_id: str = ""

    @dataclass
    class Point(IdlStruct):
        positions: sequence[float64] = field(default_factory=list)
        velocities: sequence[float64] = field(default_factory=list)
        accelerations: sequence[float64] = field(default_factory=list)
        effort: sequence[float64] = field(default_factory=list)
        time_from_start: Stamp = field(default_factory=Stamp)

    name = "control_msgs::msg::dds_::JointTrajectoryControllerState_"

    @dataclass
    class Jazzy(IdlStruct, typename=name):
        header: Header = field(default_factory=Header)
        joint_names: sequence[str] = field(default_factory=list)
        reference: Point = field(default_factory=Point)
        feedback: Point = field(default_factory=Point)
        error: Point = field(default_factory=Point)
        output: Point = field(default_factory=Point)
        multi_dof_joint_names: sequence[str] = field(default_factory=list)
        multi_dof_reference: sequence[float64] = field(default_factory=lambda: [0.0] * 20)
        speed_scaling_factor: float64 = 1.0

    @dataclass
    class Humble(IdlStruct, typename=name):
        header: Header = field(default_factory=Header)
        joint_names: sequence[str] = field(default_factory=list)
        reference: Point = field(default_factory=Point)
        feedback: Point = field(default_factory=Point)
        error: Point = field(default_factory=Point)
        output: Point = field(default_factory=Point)
        desired: Point = field(default_factory=Point)
        actual: Point = field(default_factory=Point)
        multi_dof_joint_names: sequence[str] = field(default_factory=list)

    message = {"jazzy": Jazzy, "humble": Humble}[layout]
    everyone = cyclonedds.Domain(domain, NEIGHBOURS)
    participant = cyclonedds.DomainParticipant(domain)
    writer = DataWriter(participant, Topic(participant, f"rt{controller}/controller_state", message))
    ends = threading.Event()

    def publish():
        while not ends.wait(0.02):
            writer.write(message())  # names no joint: the controller is active, and its set-point unknown

    thread = threading.Thread(target=publish, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ends.set()
        thread.join()
        del writer, participant, everyone


@needs_rclpy
def test_every_field_of_every_message_comes_back_as_it_was(domain):
    with run(domain, ECHO), Peer(domain, "echo") as peer:
        for _ in range(5 * 3):
            words = peer.until(lambda words: "same" in words)
            assert words["same"], words


@needs_rclpy
def test_a_node_that_listens_to_no_multicast_is_found_by_default(domain):
    """As ROS nodes find it, though the program itself was told nothing but how to stay on this computer."""
    environment = {**os.environ, "CYCLONEDDS_URI": NO_MULTICAST}
    del environment["ROS_AUTOMATIC_DISCOVERY_RANGE"]
    with run(domain, ECHO, environment=environment), Peer(domain, "echo") as peer:
        assert peer.until(lambda words: "same" in words)["same"]


@needs_rclpy
@pytest.mark.parametrize("layout", ["jazzy", "humble"])
@pytest.mark.long
def test_an_arm_of_rclpy_is_led_by_a_hand_of_rclpy_and_shown_to_it(domain, tmp_path, layout):
    """And stops when the hardware tells that it is slowed down."""
    world = {
        "controller": "/robot/controller",
        "joint_states": "/robot/states",
        "prefix": "left_",
        "hand": "/vr/hand",
        "speed_scaling": "/robot/speed_scaling",
    }
    settings = [f"ros2.{key}={value}" for key, value in world.items()]
    with (
        Peer(domain, "world", json.dumps(world)) as peer,
        controller_states(domain, "/robot/controller", layout),
        demo(domain, tmp_path, *settings) as program,
    ):
        peer.beside = program
        words = peer.until(lambda words: words.get("trajectories", 0) > 3)
        assert words["first_goal"] == pytest.approx(HOME)  # the first goal is to stay where it is
        assert words["moved"] < 1e-6
        peer.ask(hand=True)
        shown = peer.until(lambda words: words.get("moved", 0.0) > 0.02 and "liquid" in words and "path" in words)
        assert shown["target"] == shown["path"] == "left_base_link"
        assert shown["liquid"] == [["glass", 3, 0], ["liquid", 3, 0]]
        assert shown["faults"] == []
        assert 0.02 < shown["largest_speed"] < 0.25 * 3.2 + 0.4  # a tick that comes early or late adds to it
        if layout == "jazzy":
            peer.ask(topics=True)
            topics = peer.until(lambda words: "topics" in words)["topics"]
            for topic in topics:
                assert topic["publishers"] == 1, topic
                assert topic["hashes"] == [topic["expected"]], topic
            assert topics[0]["lifespans"] == pytest.approx([0.45])  # of trajectories: the lead less a period
        peer.beside = None  # that ends it
        peer.ask(speed=50.0)
        assert peer.until_it_stands()["faults"] == []
        program.send_signal(signal.SIGTERM)
        assert "speed scaling is not 100 %" in program.communicate(timeout=60)[0]


@pytest.mark.long
def test_the_reference_controller_is_led_by_a_recorded_hand(domain, tmp_path):
    """Which then says what its set-points were like. Without rclpy."""
    hand = tmp_path / "hand.csv"
    rows = [(0.01 * i, 0.04 * (1.0 - math.cos(0.02 * i)), i % 250 > 50) for i in range(750)]
    lines = [f"{t:.3f},{x:.6f},0,0.2,0,0,0,1,{int(gripped)}" for t, x, gripped in rows]
    hand.write_text("t,px,py,pz,qx,qy,qz,qw,clutch\n" + "\n".join(lines) + "\n")
    with run(domain, CONTROLLER, "--rate", "100") as controller, demo(domain, tmp_path, input=hand) as program:
        time.sleep(8.0)
        program.send_signal(signal.SIGTERM)
        told = program.communicate(timeout=60)[0]
        assert re.findall("held or stopped.*", told) == ["held or stopped    1 x a stop was asked for"], told
        assert float(re.search(r"engaged ([0-9.]+) s", told).group(1)) > 1.0, told
        controller.send_signal(signal.SIGTERM)
        told = controller.communicate(timeout=20)[0]
        assert re.search(r"[1-9][0-9]* trajectories.* 0 refused.*no stop", told), told
        assert 0.01 < float(re.search(r"largest speed ([0-9.]+)", told).group(1)) < 0.25 * 3.2, told
        assert float(re.search(r"position ([0-9.]+) mrad", told).group(1)) < 0.5, told


def check(domain, *options):
    command = [PROGRAM, "check", "--arm", "ros2", "--seconds", "1.5", *options]
    environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
    return subprocess.run(command, capture_output=True, text=True, env=environment, timeout=60)


def test_check_tells_an_inactive_controller_from_an_active_one(domain):
    with run(domain, CONTROLLER, "--inactive"):
        done = check(domain)
        assert done.returncode == 1 and "listens, but is not active" in done.stdout, done.stdout
    with run(domain, CONTROLLER):
        assert "not active" not in check(domain).stdout


@pytest.mark.long
def test_a_stage_of_check_measures_the_delay_and_writes_it(domain, tmp_path):
    settings = tmp_path / "settings.yaml"
    stage = ["--stage", "slow", "--settings", str(settings), "--set", "ros2.look_ahead=0.23", "ros2.state_timeout=0.2"]
    with run(domain, CONTROLLER, "--servo-lag", "0.08"):
        assert check(domain, *stage).returncode == 2  # no operator could confirm
        done = check(domain, "--yes", *stage)
        assert done.returncode == 0, done.stdout + done.stderr
        measured = re.search(r"servo_delay: ([0-9.]+)", settings.read_text())
        assert 0.06 < float(measured.group(1)) < 0.1, done.stdout


def test_nobody_there_and_another_domain(domain, tmp_path):
    with run(domain % 100 + 1, CONTROLLER):
        command = [PROGRAM, "demo", "--arm", "ros2", "--headless", "--hand-on-hardware", "--yes", "--sessions", str(tmp_path)]
        environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
        short = ["--set", "ros2.start_within=0.5"]
        done = subprocess.run([*command, *short], capture_output=True, text=True, env=environment, timeout=60)
        assert done.returncode == 2 and "/joint_states" in done.stderr
        for name, value in (("ROS_DOMAIN_ID", "233"), ("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF"), ("ROS_STATIC_PEERS", "a;<b>")):
            wrong = {**environment, name: value}
            done = subprocess.run(command, capture_output=True, text=True, env=wrong, timeout=60)
            assert done.returncode == 2 and name in done.stderr and value.split(";")[-1] in done.stderr, done.stderr


def test_the_arm_is_a_setting_too(domain, tmp_path):
    command = [PROGRAM, "demo", "--headless", "--hand-on-hardware", "--yes", "--sessions", str(tmp_path), "--set", "ros2.start_within=0.2"]
    environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
    done = subprocess.run(
        [*command, "arm.kind=ros2"], capture_output=True, text=True, env=environment, timeout=60
    )
    assert done.returncode == 2 and "/joint_states" in done.stderr
    done = subprocess.run([*command, "arm.kind=ros"], capture_output=True, text=True, env=environment, timeout=60)
    assert done.returncode == 2 and "arm.kind" in done.stderr
