"""`steadyhand replay` from end to end, as a user runs it: what each profile does, determinism, limits, bad input."""

import csv
import json
import math
import shutil
import subprocess
from pathlib import Path

import pytest
from mcap.reader import make_reader

from places import PROGRAM, ROOT

PROFILES = ("tracking", "anti-slosh", "waiter")
JOINTS = range(6)


def run(*arguments):
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=900)


def rows(folder, profile):
    with open(folder / profile / "plan.csv", newline="") as file:
        return list(csv.DictReader(file))


def mean(values):
    values = list(values)
    return sum(values) / len(values)


def lateral(row):
    return math.hypot(float(row["local_acceleration_x_m_s2"]), float(row["local_acceleration_y_m_s2"]))


def position_rms(steps):
    return math.sqrt(mean(sum((float(s[f"planned_{c}_m"]) - float(s[f"target_{c}_m"])) ** 2 for c in "xyz") for s in steps))


@pytest.fixture(scope="module")
def arm():
    return json.loads(run("describe", "ur5e").stdout)


@pytest.fixture(scope="module")
def bundled(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bundled")
    result = run("replay", "--out", folder)
    assert result.returncode == 0, result.stderr
    return folder, result.stdout


def test_prints_table_and_leaves_report_and_data(bundled):
    folder, printed = bundled
    assert "Lateral specific force, mean" in printed and str(folder / "report.html") in printed
    assert (folder / "report.html").stat().st_size > 100_000
    for profile in PROFILES:
        assert len(rows(folder, profile)) == 220  # 11 s at 20 Hz


def test_what_the_profiles_do(bundled):
    folder, _ = bundled
    tracking, anti_slosh, waiter = (rows(folder, profile) for profile in PROFILES)
    of_tracking = mean(map(lateral, tracking))
    assert mean(map(lateral, anti_slosh)) <= 0.25 * of_tracking
    assert mean(map(lateral, waiter)) <= 0.35 * of_tracking
    assert position_rms(waiter) <= 0.65 * position_rms(anti_slosh)
    assert min(float(s["local_acceleration_z_m_s2"]) for s in waiter) >= 0.4 * 9.81
    assert position_rms(tracking) <= 0.03


def test_every_step_is_solved_and_inside_all_limits(bundled, arm):
    folder, _ = bundled
    for profile in PROFILES:
        for step in rows(folder, profile):
            assert step["status"] == "solved"
            assert float(step["smallest_sphere_distance_m"]) >= -1e-5
            for i in JOINTS:
                assert arm["position_min"][i] - 1e-6 <= float(step[f"q{i}_rad"]) <= arm["position_max"][i] + 1e-6
                assert abs(float(step[f"dq{i}_rad_s"])) <= arm["velocity_max"][i] + 1e-6
                assert abs(float(step[f"ddq{i}_rad_s2"])) <= arm["acceleration_max"][i] + 1e-6
            shares = sum(float(value) for name, value in step.items() if name.startswith("objective_"))
            assert shares == pytest.approx(float(step["objective"]), rel=1e-9, abs=1e-12)


def test_commands_at_500_hz_are_smooth_and_inside(bundled, arm):
    folder, _ = bundled
    for profile in PROFILES:
        with open(folder / profile / "session.mcap", "rb") as file:
            commands = [json.loads(m.data) for _, _, m in make_reader(file).iter_messages(topics=["/joint_command"])]
        assert len(commands) == 11 * 500
        for before, now in zip(commands, commands[1:]):
            for i in JOINTS:
                assert abs(now["dq"][i]) <= arm["velocity_max"][i] + 1e-5
                assert abs(now["ddq"][i]) <= arm["acceleration_max"][i] + 1e-5
                # At most what the limits allow in 2 ms.
                assert abs(now["dq"][i] - before["dq"][i]) <= 0.002 * arm["acceleration_max"][i] + 1e-5
                moved = now["q"][i] - before["q"][i]
                assert abs(moved - 0.001 * (now["dq"][i] + before["dq"][i])) <= 1e-5


def test_follow_is_nearer_to_the_hand_than_tracking(bundled, tmp_path):
    result = run("replay", "--profile", "follow", "--out", tmp_path)
    assert result.returncode == 0, result.stderr
    followed = rows(tmp_path, "follow")
    assert all(step["status"] == "solved" for step in followed)
    assert position_rms(followed) < 0.85 * position_rms(rows(bundled[0], "tracking"))


def test_an_arm_under_the_ceiling_follows_as_one_on_a_pedestal(bundled, tmp_path):
    folder, _ = bundled
    arguments = ("--robot", "ur5e_ceiling", "--cell", "ceiling", "--profile", "waiter", "--out", tmp_path)
    result = run("replay", *arguments)
    assert result.returncode == 0, result.stderr
    hanging, standing = rows(tmp_path, "waiter"), rows(folder, "waiter")
    assert len(hanging) == len(standing)
    assert all(step["status"] == "solved" for step in hanging)
    assert position_rms(hanging) < 1.5 * position_rms(standing)
    # The glass is held the right way up, and gravity pulls down in it.
    assert mean(float(step["local_acceleration_z_m_s2"]) for step in hanging) > 9.0


def test_every_arrow_is_recorded(bundled):
    folder, _ = bundled
    with open(folder / "waiter" / "session.mcap", "rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        counts = {summary.channels[k].topic: n for k, n in summary.statistics.channel_message_counts.items()}
    assert set(counts) == {"/operator_sample", "/target", "/reference", "/plan", "/joint_command", "/joint_state", "/plan_step"}
    assert counts["/operator_sample"] == counts["/target"] > 900
    assert counts["/reference"] == counts["/plan"] == counts["/plan_step"] == 220
    assert counts["/joint_command"] == counts["/joint_state"] == 5500


def test_twice_the_same_bytes_apart_from_times(bundled, tmp_path):
    folder, _ = bundled
    assert run("replay", "--profile", "anti-slosh", "--out", tmp_path).returncode == 0
    first, second = rows(folder, "anti-slosh"), rows(tmp_path, "anti-slosh")
    assert len(first) == len(second)
    for a, b in zip(first, second):
        del a["solve_time_us"], b["solve_time_us"]
        assert a == b


def write_csv(path, header="t,px,py,pz,qx,qy,qz,qw", edit=lambda i, row: row, count=200):
    lines = [header]
    for i in range(count):
        row = [i / 90, 0.1 * math.sin(i / 30), 0.1 * math.cos(i / 40), 1.0, 0.0, 0.0, 0.0, 1.0]
        lines.append(",".join(str(value) for value in edit(i, row)))
    path.write_text("\n".join(lines) + "\n")
    return path


def test_csv_with_clutch_at_another_rate(tmp_path):
    """Released: the arm calms down where it was let go; engaged again with the hand elsewhere: no jump."""
    def edit(i, row):
        return [row[0], row[1] + (0.5 if i > 240 else 0.0), *row[2:], int(not 60 < i <= 240)]
    hand = write_csv(tmp_path / "hand.csv", "t,px,py,pz,qx,qy,qz,qw,clutch", edit, count=320)
    result = run("replay", hand, "--profile", "waiter", "--rate", "37", "--scale", "1", "--out", tmp_path / "out")
    assert result.returncode == 0, result.stderr
    steps = rows(tmp_path / "out", "waiter")
    released = [s for s in steps if s["engaged"] == "0"]
    assert len(released) > 60 and len({s["target_x_m"] for s in released}) == 1
    # Waiter returns gently, swinging about the pose of the release.
    assert all(abs(float(released[-1][f"dq{i}_rad_s"])) < 0.1 for i in JOINTS)
    assert all(abs(float(released[-1][f"planned_{c}_m"]) - float(released[-1][f"target_{c}_m"])) < 0.02 for c in "xyz")
    for before, now in zip(steps, steps[1:]):
        assert abs(float(now["planned_x_m"]) - float(before["planned_x_m"])) < 0.03


def test_a_jump_for_one_frame_does_not_move_the_glass(tmp_path):
    def moved(folder):
        return [tuple(float(row[f"planned_{axis}_m"]) for axis in "xyz") for row in rows(folder, "waiter")]

    def jump(i, row):
        if i == 100:
            row[1] += 0.7
        return row

    still = lambda i, row: [row[0], 0.1, 0.1, 1.0, 0, 0, 0, 1]
    for name, edit in [("calm", still), ("jump", lambda i, row: jump(i, still(i, row)))]:
        hand = write_csv(tmp_path / f"{name}.csv", edit=edit)
        result = run("replay", hand, "--profile", "waiter", "--out", tmp_path / name, "--scale", 1)
        assert result.returncode == 0, result.stderr
        assert ("samples were rejected" in result.stdout) == (name == "jump")
    assert max(math.dist(a, b) for a, b in zip(moved(tmp_path / "calm"), moved(tmp_path / "jump"))) < 0.002


@pytest.mark.parametrize("name, make, words", [
    ("NaN", lambda p: write_csv(p, edit=lambda i, row: [*row[:2], "nan" if i == 50 else row[2], *row[3:]]), ["52", "nan"]),
    ("no such file", lambda p: p, []),
    ("times in ms", lambda p: write_csv(p, edit=lambda i, row: [1000 * row[0], *row[1:]]), ["11.1", "in ms", "in s"]),
])
def test_bad_recording(tmp_path, name, make, words):
    path = tmp_path / "hand.csv"
    make(path)
    result = run("replay", path, "--out", tmp_path / "out")
    assert result.returncode == 2 and result.stdout == ""
    for word in ["hand.csv", *words]:
        assert word in result.stderr, result.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("arguments, words", [
    (["--rate", "0"], ["rate", "0"]),
    (["--rate", "1e-9"], ["rate", "1e-09", "from 1 to 500"]),
    (["--rate", "1000"], ["rate", "1000"]),
    (["--rate", "nan"], ["rate"]),
    (["--scale", "-1"], ["scale", "-1"]),
    (["--scale", "inf"], ["scale"]),
    (["--yaw", "nan"], ["yaw"]),
    (["--solver", "magic"], ["magic", "fatrop"]),
    (["--profile", "calm"], ["calm", "waiter"]),
    (["--profile", "waiter", "waiter"], ["waiter", "twice"]),
    (["--robot", "ur9"], ["ur9", "ur5e"]),
    (["--rotation-frame", "moon"], ["moon", "base"]),
    (["--until", "0"], ["ends at 0 s"]),
    (["--speed", "3"], ["--speed"]),
])
def test_bad_options(tmp_path, arguments, words):
    result = run("replay", *arguments, "--out", tmp_path / "out")
    assert result.returncode == 2 and result.stdout == ""
    for word in words:
        assert word in result.stderr, result.stderr
    assert not (tmp_path / "out").exists()


def urdf_folder(tmp_path):
    source = next((ROOT / ".deps/venv/lib").glob("python3*/site-packages/airo_models/arms/ur5e"))
    return Path(shutil.copytree(source, tmp_path / "ur5e"))


def test_urdf_with_a_missing_mesh_and_with_a_loop(tmp_path):
    folder = urdf_folder(tmp_path)
    urdf = folder / "ur5e.urdf"
    assert run("describe", urdf).returncode == 0
    (folder / "visual" / "forearm.obj").unlink()
    result = run("replay", "--robot", urdf, "--out", tmp_path / "out")
    assert result.returncode == 2 and "forearm.obj" in result.stderr
    loop = '<joint name="loop" type="fixed"><parent link="tool0"/><child link="base_link"/></joint></robot>'
    urdf.write_text(urdf.read_text().replace("</robot>", loop))
    result = run("replay", "--robot", urdf, "--out", tmp_path / "out")
    assert result.returncode == 2 and "loop" in result.stderr


def test_out_that_cannot_be_written(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("")
    result = run("replay", "--profile", "waiter", "--out", blocked)
    assert result.returncode == 2 and str(blocked) in result.stderr
