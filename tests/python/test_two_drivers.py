"""Each arm of a robot with two behind its own driver."""

import subprocess
import time

import pytest

from places import PROGRAM
from test_fake_ur_controller import controller


def run(*arguments, seconds=0.5):
    command = [PROGRAM, "demo", "--headless", "--no-recording", "--seconds", str(seconds), *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=120)


@pytest.mark.parametrize(
    "arm, says",
    [
        ("left=sim,left=sim", "arm 'left' is named twice"),
        ("left=sim,rigth=sim", "--arm names 'rigth', which robot 'two_ur5e' does not have; did you mean 'right'?"),
        ("left=sim", "--arm does not name arm 'right' of robot 'two_ur5e': add right=KIND"),
        ("left=sim,right=urr", "--arm right=urr: the kind is 'urr'"),
        ("left=sim,right=ur", "ur needs the address of this arm's controller: right=ur:ADDRESS"),
        ("left=sim,right=sim:10.0.0.1", "sim has no address: right=sim"),
        ("left=sim,right=mujoco", "--arm mujoco"),
        ("left=sim,right", "--arm right: each of two arms is NAME=KIND or NAME=KIND:ADDRESS"),
        ("left=sim,", "each of two arms is NAME=KIND"),
        ("left=ur:10.0.0.1,right=ur:10.0.0.1", "it is the controller of arm 'left', too"),
        ("left=ros2,right=ros2", "it is the controller of arm 'left', too; each arm has its own: right=ros2:/CONTROLLER"),
        ("left=ros2,right=ros2:/joint_trajectory_controller", "one controller of all joints is --arm ros2"),
    ],
)
def test_arms_that_the_robot_does_not_have_are_refused(arm, says):
    done = run("--robot", "two_ur5e", "--hand-on-hardware", "--yes", "--arm", arm)
    if "built without ROS 2" in done.stderr:
        pytest.skip("built without ROS 2")
    assert done.returncode == 2 and says in done.stderr, done.stderr


@pytest.mark.parametrize(
    "options, says",
    [
        (["--robot", "ur5e"], "robot 'ur5e' has one tool; two drivers are for robots with two"),
        (["--robot", "two_ur5e", "--host", "x"], "--host belongs to --arm ur"),
    ],
)
def test_options_that_do_not_go_with_two_drivers_are_refused(options, says):
    done = run("--arm", "left=sim,right=sim", *options)
    assert done.returncode == 2 and says in done.stderr, done.stderr


def test_hardware_asks_before_it_moves():
    done = run("--robot", "two_ur5e", "--arm", "left=sim,right=ur:127.0.0.1")
    assert done.returncode == 2 and "--headless would move a real arm" in done.stderr
    done = run("--robot", "two_ur5e", "--arm", "left=sim,right=ur:127.0.0.1", "--hand-on-hardware")
    assert done.returncode == 2 and "add --yes" in done.stderr and "The arm 'right' at 127.0.0.1 will MOVE" in done.stdout


def test_two_simulated_arms_follow_at_their_rates(tmp_path):
    done = run("--robot", "two_ur5e", "--arm", "left=sim,right=sim", seconds=3)
    assert "left: two_ur5e left (simulated); right: two_ur5e right (simulated)" in done.stdout, done.stdout + done.stderr
    assert done.returncode == 0 or "no command arrived in time" in done.stdout, done.stdout + done.stderr  # on a busy machine
    assert " 0 in contact" in done.stdout, done.stdout


def test_a_protective_stop_of_one_controller_stops_both_and_is_named():
    with controller() as (left, first), controller() as (right, second):
        arms = f"left=ur:{left},right=ur:{right}"
        command = [PROGRAM, "demo", "--headless", "--no-recording", "--hand-on-hardware", "--yes", "--robot", "two_ur5e", "--arm", arms]
        demo = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        time.sleep(6.0)
        first.stdin.write("protective\n")
        first.stdin.flush()
        out, err = demo.communicate(timeout=60)
        assert demo.returncode == 1 and "left: " in out, out + err  # on a busy machine either may stop before
        for process in (first, second):
            process.terminate()
            fake, _ = process.communicate(timeout=20)
            assert float(fake.split("largest speed ")[1].split()[0]) < 0.9, fake
