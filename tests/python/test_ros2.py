"""The ROS 2 side before an independent peer: PyPI's cyclonedds with the messages of ros2-pyterfaces. Each message goes over
the wire in each direction in which it is used, and, with every field filled, in both."""

import contextlib
import math
import os
import random
import signal
import subprocess
import time
from pathlib import Path

import pytest

import ros2_peer

pytest.importorskip("cyclonedds", reason="cyclonedds is not published for this Python")
pytest.importorskip("ros2_pyterfaces", reason="ros2-pyterfaces is not published for this Python")
from ros2_pyterfaces.cyclone.builtin_interfaces.msg import Duration, Time  # noqa: E402
from ros2_pyterfaces.cyclone.geometry_msgs.msg import PoseStamped  # noqa: E402
from ros2_pyterfaces.cyclone.nav_msgs.msg import Path as PathMessage  # noqa: E402
from ros2_pyterfaces.cyclone.sensor_msgs.msg import JointState  # noqa: E402
from ros2_pyterfaces.cyclone.trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint  # noqa: E402
from ros2_pyterfaces.cyclone.visualization_msgs.msg import MarkerArray  # noqa: E402

ROOT = Path(os.environ.get("STEADYHAND_ROOT", Path(__file__).resolve().parents[2]))
PROGRAM = os.environ.get("STEADYHAND_PROGRAM", str(ROOT / "build/release/steadyhand"))
CONTROLLER = str(Path(PROGRAM).parent / "reference_controller")
ECHO = str(Path(PROGRAM).parent / "ros2_echo")
if not Path(CONTROLLER).exists():
    pytest.skip("built without ROS 2", allow_module_level=True)

JOINTS = [
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "elbow_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
]
# For machines that stall: a tenth of the cycles, and half a second of patience with everything.
PATIENT = [
    *("ros2.control_rate=100", "ros2.rate=20", "ros2.lead=0.5", "ros2.silence=0.4", "ros2.start_within=40"),
    *("control.off_plan_max=0.3", "control.stall_cycles=1000"),
]


@contextlib.contextmanager
def run(domain, *command):
    environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment)
    try:
        yield process
    finally:
        process.send_signal(signal.SIGTERM)
        try:
            print(process.communicate(timeout=40)[0])  # to be seen if the test fails
        except subprocess.TimeoutExpired:
            process.kill()


def demo(domain, folder, *settings):
    return run(
        domain,
        PROGRAM,
        *("demo", "--arm", "ros2", "--headless", "--yes", "--rate", "20", "--sessions", str(folder)),
        *("--seconds", "120", "--set", *PATIENT, *settings),
    )


@pytest.fixture
def domain():
    return ros2_peer.any_domain()


@pytest.fixture
def peer(domain):
    return ros2_peer.Peer(domain)


def test_the_controller_takes_and_tells_what_ros_would(domain, peer):
    states = peer.reader("/joint_states", JointState)
    trajectories = peer.writer("/scaled_joint_trajectory_controller/joint_trajectory", JointTrajectory)
    with run(domain, CONTROLLER):
        state = ros2_peer.take_until(states)
        assert state is not None and sorted(state.name) == sorted(JOINTS)
        assert len(state.position) == len(state.velocity) == 6 and state.header.stamp.sec > 0
        start = dict(zip(state.name, state.position))
        names = sorted(JOINTS)  # in an order of our own
        goal = {name: start[name] + 0.1 * (i + 1) for i, name in enumerate(names)}
        point = JointTrajectoryPoint(
            positions=[goal[n] for n in names],
            velocities=[0.0] * 6,
            accelerations=[0.0] * 6,
            time_from_start=Duration(sec=1, nanosec=500_000_000),
        )
        trajectories.write(JointTrajectory(joint_names=names, points=[point]))

        def there(message):
            return all(abs(q - goal[n]) < 1e-3 for n, q in zip(message.name, message.position))

        assert ros2_peer.take_until(states, there) is not None


def test_the_arm_follows_a_hand_from_a_topic_and_shows_it(domain, peer, tmp_path):
    states = peer.reader("/joint_states", JointState)
    trajectories = peer.reader("/scaled_joint_trajectory_controller/joint_trajectory", JointTrajectory)
    shown = {
        "target": peer.reader("/steadyhand/target", PoseStamped),
        "path": peer.reader("/steadyhand/path", PathMessage),
        "liquid": peer.reader("/steadyhand/liquid", MarkerArray),
    }
    hand = peer.writer("/vr/hand", PoseStamped)
    began = []

    def move_hand():
        """Six centimetres, slowly, there and back."""
        began.append(time.monotonic())
        pose = PoseStamped()
        pose.header.stamp = Time(sec=int(time.time()), nanosec=int(1e9 * (time.time() % 1)))
        pose.pose.position.x = 0.03 * (1.0 - math.cos(0.8 * (began[-1] - began[0])))
        pose.pose.orientation.w = 1.0
        hand.write(pose)

    with run(domain, CONTROLLER), demo(domain, tmp_path, "ros2.hand=/vr/hand"):
        trajectory = ros2_peer.take_until(trajectories, lambda m: len(m.points) > 2)
        assert trajectory is not None, "nothing was sent to the controller"
        assert sorted(trajectory.joint_names) == sorted(JOINTS)
        state = ros2_peer.take_until(states)
        start = dict(zip(state.name, state.position))
        last = [None]

        def moved(message):
            times = [p.time_from_start.sec + 1e-9 * p.time_from_start.nanosec for p in message.points]
            assert times == sorted(set(times))
            assert all(len(p.positions) == len(p.velocities) == len(p.accelerations) == 6 for p in message.points)
            assert not any(message.points[-1].velocities)
            last[0] = message
            goal = dict(zip(message.joint_names, message.points[-1].positions))
            return max(abs(goal[n] - start[n]) for n in JOINTS) > 0.01

        assert ros2_peer.take_until(trajectories, moved, 60.0, move_hand) is not None, last[0]
        assert ros2_peer.take_until(
            states, lambda m: max(abs(q - start[n]) for n, q in zip(m.name, m.position)) > 0.005, 40.0, move_hand
        ), "the arm did not move"
        target = ros2_peer.take_until(shown["target"])
        assert target.header.frame_id and target.header.stamp.sec > 0
        q = target.pose.orientation
        assert math.isclose(q.x**2 + q.y**2 + q.z**2 + q.w**2, 1.0, abs_tol=1e-6)
        path = ros2_peer.take_until(shown["path"], lambda m: len(m.poses) > 1)
        assert path.poses[0].header.frame_id == target.header.frame_id
        markers = ros2_peer.take_until(shown["liquid"]).markers
        assert [(m.ns, m.type, m.action) for m in markers] == [("glass", 3, 0), ("liquid", 3, 0)]
        assert all(m.scale.x > 0.0 and m.color.a > 0.0 for m in markers)


def test_the_arm_takes_joint_states_of_a_peer_and_sends_it_trajectories(domain, peer, tmp_path):
    states = peer.writer("/robot/states", JointState)
    trajectories = peer.reader("/robot/controller/joint_trajectory", JointTrajectory)
    home = {"shoulder_lift_joint": -1.3, "elbow_joint": 1.6}
    order = JOINTS[3:] + ["gripper"] + JOINTS[:3]

    def tell():
        now = time.time()
        message = JointState(
            name=["left_" + n for n in order],
            position=[home.get(n, 0.4) for n in order],
            velocity=[0.0] * len(order),
            effort=[0.0] * len(order),
        )
        message.header.stamp = Time(sec=int(now), nanosec=int(1e9 * (now % 1)))
        states.write(message)

    settings = ["ros2.controller=/robot/controller", "ros2.joint_states=/robot/states", "ros2.prefix=left_"]
    with demo(domain, tmp_path, *settings):
        first = ros2_peer.take_until(trajectories, meanwhile=tell)
        assert first is not None, "nothing was sent to the controller"
        assert first.joint_names == ["left_" + n for n in JOINTS]
        # At first that it is to stand where it stands.
        assert first.points[-1].positions == pytest.approx([home.get(n, 0.4) for n in JOINTS])


def test_every_field_of_every_message_comes_back_as_it_was(domain, peer):
    some = random.Random(7)
    with run(domain, ECHO):
        for message in [JointTrajectory, JointState, PoseStamped, PathMessage, MarkerArray]:
            there = peer.writer(f"/echo/in/{message.__name__}", message)
            back = peer.reader(f"/echo/out/{message.__name__}", message)
            for sample in [
                message(),  # of empty sequences and strings
                ros2_peer.filled(message, some, [1, 2, 3]),
                ros2_peer.filled(message, some, [0, 1, 40]),
            ]:
                wrong = ["nothing came"]

                def same(answer):
                    wrong[:] = ros2_peer.differences(sample, answer)
                    return not wrong

                assert ros2_peer.take_until(back, same, meanwhile=lambda: there.write(sample)), wrong


def test_nobody_there_and_another_domain(domain, tmp_path):
    with run(domain % 100 + 1, CONTROLLER):
        command = [PROGRAM, "demo", "--arm", "ros2", "--headless", "--yes", "--sessions", str(tmp_path)]
        environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
        done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=60)
        assert done.returncode == 2 and "/joint_states" in done.stderr
        environment["ROS_DOMAIN_ID"] = "233"
        done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=60)
        assert done.returncode == 2 and "ROS_DOMAIN_ID is '233'" in done.stderr


def test_the_arm_is_a_setting_too(domain, tmp_path):
    command = [PROGRAM, "demo", "--headless", "--yes", "--sessions", str(tmp_path), "--set", "ros2.start_within=0.2"]
    environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
    done = subprocess.run(
        [*command, "arm.kind=ros2"], capture_output=True, text=True, env=environment, timeout=60
    )
    assert done.returncode == 2 and "/joint_states" in done.stderr
    done = subprocess.run([*command, "arm.kind=ros"], capture_output=True, text=True, env=environment, timeout=60)
    assert done.returncode == 2 and "arm.kind" in done.stderr
