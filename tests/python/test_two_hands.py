"""Two hands that move two arms: their recordings, replayed by the program and from Python, read back, and made into data sets."""

import json
import subprocess

import numpy as np
import pytest
from mcap.reader import make_reader
from places import PROGRAM

import steadyhand

HANDS = ("left", "right")


def rows_of_two_hands(seconds=3.0, towards=0.0):
    """CSV: 90 samples a second of each hand, the right one 4 ms later. They circle, and meet by `towards` m."""
    names = ("px", "py", "pz", "qx", "qy", "qz", "qw")
    lines = ["t," + ",".join(f"{hand}_{name}" for hand in HANDS for name in names)]
    for k in range(int(90 * seconds)):
        for hand, late in ((0, 0.0), (1, 0.004)):
            t = k / 90 + late
            side = 1 if hand == 0 else -1
            p = (0.1 * np.sin(2 * t), side * (0.05 * np.sin(3 * t) - towards * t / seconds), 0.06 * np.sin(2.5 * t + hand))
            cells = [f"{value:.6f}" for value in (*p, 0, 0, 0, 1)]
            lines.append(f"{t:.6f}," + ",".join(cells + [""] * 7 if hand == 0 else [""] * 7 + cells))
    return "\n".join(lines) + "\n"


def replay(folder, file, *options, robot="two_ur5e"):
    return subprocess.run(
        [PROGRAM, "replay", file, "--robot", robot, "--yaw", "0", "--cell", "none", "--profile", "tracking", "--out", folder / "out", *options],
        capture_output=True, text=True, timeout=600,
    )  # fmt: skip


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    folder = tmp_path_factory.mktemp("two")
    (folder / "hands.csv").write_text(rows_of_two_hands())
    done = replay(folder, folder / "hands.csv")
    assert done.returncode == 0, done.stderr
    return folder, done.stdout


def messages(path):
    with open(path, "rb") as file:
        return [(channel.topic, json.loads(message.data)) for _, channel, message in make_reader(file).iter_messages()]


def value_of(table, row):
    (line,) = [line for line in table.splitlines() if line.strip().startswith(row)]
    return float(line.split()[-1])


def test_the_table_has_the_tracking_error_of_each_tool(recorded):
    _, table = recorded
    for hand in HANDS:
        assert 0.0 < value_of(table, f"Position error, RMS, {hand}") < 10.0
    assert value_of(table, "Failures") == 0
    assert value_of(table, "Distance between arms, smallest") > 0.0 < value_of(table, "Distance between bodies, smallest")
    assert value_of(table, "Joint speed, largest of limit") <= 100.0 + 1e-6 >= value_of(table, "Joint acceleration, largest of limit")


def test_an_independent_reader_finds_both_tools(recorded):
    folder, _ = recorded
    found = messages(folder / "out/tracking/session.mcap")
    tools = [message.get("tool", 0) for topic, message in found if topic == "/operator_sample"]
    assert tools[:4] == [0, 1, 0, 1] and all("tool" not in message or message["tool"] == 1 for _, message in found)
    steps = [message for topic, message in found if topic == "/plan_step"]
    assert all(step["engaged"] and step["second_tool"]["engaged"] for step in steps[1:])
    plans = [message for topic, message in found if topic == "/plan"]
    assert all(len(plan["second_tool"]["poses"]) == len(plan["poses"]) for plan in plans)
    ys = [(plan["poses"][0]["position"]["y"], plan["second_tool"]["poses"][0]["position"]["y"]) for plan in plans]
    assert all(left > 0.1 > -0.1 > right for left, right in ys), "the left tool is on the left"


def test_hands_that_meet_do_not_bring_the_arms_into_contact(tmp_path):
    (tmp_path / "hands.csv").write_text(rows_of_two_hands(towards=1.5))
    done = replay(tmp_path, tmp_path / "hands.csv")
    assert done.returncode == 0, done.stderr
    assert 0.0 < value_of(done.stdout, "Distance between arms, smallest") < 50.0


def test_one_hand_moves_one_arm(tmp_path):
    (tmp_path / "hands.csv").write_text(rows_of_two_hands(1.0))
    done = replay(tmp_path, tmp_path / "hands.csv", "--track", ",right")
    assert done.returncode == 0, done.stderr
    session = steadyhand.read_session(tmp_path / "out/tracking/session.mcap")
    moved = np.abs(session.commands.q - session.commands.q[0]).max(axis=0)
    assert moved[:6].max() < 1e-3 < 0.02 < moved[6:].max()


def test_a_session_is_replayed_with_its_own_robot(recorded, tmp_path):
    folder, _ = recorded
    session = folder / "out/tracking/session.mcap"
    done = subprocess.run([PROGRAM, "replay", session, "--out", tmp_path], capture_output=True, text=True, timeout=600)
    assert done.returncode == 0 and "Position error, RMS, right" in done.stdout, done.stderr
    refused = subprocess.run([PROGRAM, "replay", session, "--robot", "ur5e", "--out", tmp_path], capture_output=True, text=True, timeout=600)
    assert refused.returncode == 2 and "the hand that moves tool 1; robot 'ur5e' has tool 0 alone" in refused.stderr
    report = subprocess.run([PROGRAM, "report", session, "--out", tmp_path / "report.html"], capture_output=True, text=True, timeout=600)
    assert report.returncode == 0 and "Position error, RMS, left" in report.stdout


@pytest.mark.parametrize(
    "options, says",
    [
        (("--track", "left,left"), 'names the hand "left" twice'),
        (("--track", "left,middle"), 'has no track "middle"; its tracks are: left, right'),
    ],
)
def test_bad_choices_are_refused(recorded, tmp_path, options, says):
    folder, _ = recorded
    done = replay(tmp_path, folder / "hands.csv", *options)
    assert done.returncode == 2 and says in done.stderr, done.stderr


def test_a_robot_with_one_arm_takes_one_hand_and_says_so(recorded, tmp_path):
    folder, _ = recorded
    done = replay(tmp_path, folder / "hands.csv", robot="ur5e")
    assert done.returncode == 0 and "the hand right is used, and left is not; --track selects" in done.stdout, done.stderr
    assert "Position error, RMS, right" not in done.stdout and "Position error, RMS" in done.stdout


def test_python_reads_and_replays_both(recorded):
    folder, _ = recorded
    session = steadyhand.read_session(folder / "out/tracking/session.mcap")
    assert session.tool_names == HANDS and session.commands.q.shape[1] == 12 and session.commands.gripper.shape[1] == 2
    m = len(session.steps.t)
    assert session.steps.T_base_target.shape == (m, 2, 4, 4) and session.steps.local_acceleration.shape == (m, 2, 3) and session.steps.engaged.shape == (m, 2)
    assert set(session.hand.tool) == {0, 1}
    robot = steadyhand.Robot("two_ur5e")
    for tool in (0, 1):
        assert np.allclose(robot.fk(session.steps.q, tool), session.steps.T_base_tool[:, tool], atol=1e-9)
    again = steadyhand.replay(folder / "hands.csv", "tracking", robot=robot, yaw=0.0, cell=[])
    assert np.allclose(again.steps.q, session.steps.q, atol=1e-9)
    from_arrays = steadyhand.replay(again.hand, "tracking", robot=robot, yaw=0.0, cell=[])
    assert np.allclose(from_arrays.steps.q, again.steps.q, atol=1e-6)


def test_python_plans_for_both():
    planner = steadyhand.Planner("two_ur5e")
    robot = planner.robot
    home = np.array([robot.fk(robot.home, tool) for tool in (0, 1)])
    targets = home.copy()
    targets[0, 2, 3] += 0.05
    targets[1, 0, 3] += 0.05
    plan = None
    for k in range(40):
        plan = planner.update(targets, t=0.05 * k)
    there = np.array([robot.fk(plan.q[-1], tool) for tool in (0, 1)])
    assert np.abs(there - targets)[:, :3, 3].max() < 0.005
    assert planner.follow(np.repeat(list(targets[:, None]), planner.horizon, axis=1), t=2.0).status == "solved"
    plan = planner.update(list(home), t=2.05, engaged=[True, False])
    for wrong in (home[0], home[:1], np.eye(3)):
        with pytest.raises(ValueError, match=r"expected \(2, 4, 4\), a pose for each tool: left, right"):
            planner.update(wrong, t=3.0)
    with pytest.raises(ValueError, match=r"tool is 2; .* has the tools 0 \(left\), 1 \(right\)"):
        robot.fk(robot.home, 2)


def test_pythons_pipeline_takes_a_hand_for_each():
    arm = steadyhand.Pipeline("two_ur5e", yaw=0.0)
    for k in range(100):
        t = 0.01 * k
        for tool, direction in ((0, 1.0), (1, -1.0)):
            T = np.eye(4)
            T[2, 3] = direction * 0.1 * t
            arm.feed(T, t, tool=tool)
        q, _, _ = arm.update(t)
    assert arm.target.shape == (2, 4, 4) and arm.engaged == (True, True)
    up = [arm.robot.fk(q, tool)[2, 3] - arm.robot.fk(arm.robot.home, tool)[2, 3] for tool in (0, 1)]
    assert up[0] > 0.03 and up[1] < -0.03
    with pytest.raises(ValueError, match="tool is 2"):
        arm.feed(np.eye(4), 2.0, tool=2)


def test_a_data_set_names_both_as_lerobots_robots_of_two_arms(recorded, tmp_path):
    pytest.importorskip("pandas")
    from steadyhand.dataset import cut, write

    folder, _ = recorded
    session, robot = steadyhand.read_session(folder / "out/tracking/session.mcap"), steadyhand.Robot("two_ur5e")
    (episode,), left_out = cut(session, robot, action="pose")
    assert not left_out
    tool, action = episode.features["observation.tool"], episode.features["action"]
    assert tool.names[0] == "left_tool.x" and tool.names[7] == "right_tool.x" and action.names == tool.names and action.values.shape == (len(episode), 14)
    assert episode.features["operator.target"].names[7] == "right_target.x"
    state = episode.features["observation.state"]
    assert state.names[0].startswith("left_") and state.names[6].startswith("right_") and state.values.shape[1] == 24
    for side in (0, 1):
        assert np.allclose(tool.values[:, 7 * side : 7 * side + 3], robot.fk(state.values[:, :12], side)[:, :3, 3], atol=1e-9)
    write(tmp_path / "set", [episode])
    names = json.loads((tmp_path / "set/meta/info.json").read_text())["features"]["action"]["names"]
    assert list(names) == list(action.names)
