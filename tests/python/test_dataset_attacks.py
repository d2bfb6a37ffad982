"""What goes wrong while data sets are made: nothing of it may cost what was there, nor end in a traceback (docs/how-to/record-data.md)."""

import dataclasses
import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from sample import PROGRAM
from test_cameras import demo, film

pd = pytest.importorskip("pandas", reason="setup/requirements-dataset.txt is not installed")
pytest.importorskip("pyarrow", reason="setup/requirements-dataset.txt is not installed")
import steadyhand  # noqa: E402
from steadyhand import dataset  # noqa: E402
from steadyhand._replay import Episode as Marked  # noqa: E402
from steadyhand.dataset import __main__ as command  # noqa: E402
from steadyhand.dataset import _lerobot  # noqa: E402

ENVIRONMENT = os.environ | {"PYTHONPATH": str(Path(PROGRAM).parent / "python")}


def make(*words):
    return command.main([str(word) for word in words])


@pytest.fixture(scope="module")
def filmed(tmp_path_factory):
    """A session with a camera."""
    folder = tmp_path_factory.mktemp("filmed")
    done = demo(folder, "--camera", f"table={film(folder / 'film.mp4', pictures=150)}", seconds=4)
    assert done.returncode == 0, done.stderr
    return next(folder.glob("*.mcap"))


@pytest.fixture(scope="module")
def by_robot(tmp_path_factory):
    """The same hand, led by two robots whose joints have the same names."""
    folder = tmp_path_factory.mktemp("robots")
    t = np.arange(0.0, 3.0, 1 / 90)
    rows = [f"{at:.5f},{0.05 * np.sin(2 * at):.6f},0,1.2,0,0,0,1" for at in t]
    (folder / "hand.csv").write_text("t,px,py,pz,qx,qy,qz,qw\n" + "\n".join(rows) + "\n")
    found = {}
    for robot in ("ur5e", "ur3e"):
        subprocess.run([PROGRAM, "replay", folder / "hand.csv", "--robot", robot, "--profile", "carry", "--out", folder / robot], check=True, capture_output=True, timeout=300)
        found[robot] = folder / robot / "carry/session.mcap"
    return found


def damaged(content, draw):
    """Cut off, with bits that changed, with a piece missing, or with a piece of noise."""
    content = bytearray(content)
    at = draw.randrange(len(content))
    kind = draw.randrange(4)
    if kind == 0:
        return content[:at]
    if kind == 1:
        for _ in range(draw.choice([1, 5, 50])):
            content[draw.randrange(len(content))] ^= 1 << draw.randrange(8)
    if kind == 2:
        del content[at : at + draw.randrange(1, 5000)]
    if kind == 3:
        content[at : at + 200] = draw.randbytes(200)
    return content


@pytest.mark.long
def test_damaged_sessions_are_named_and_nothing_is_left_behind(filmed, tmp_path, capsys):
    draw = random.Random(5)
    whole = filmed.read_bytes()
    ends = {0: 0, 2: 0}
    for _ in range(25):
        (tmp_path / "session.mcap").write_bytes(damaged(whole, draw))
        code = make(tmp_path / "session.mcap", "--out", tmp_path / "set", "--episodes", "session", "--shortest", 0.1, "--picture-pause", 10)
        ends[code] += 1
        if code == 0:
            whole_parts = json.loads((tmp_path / "set/meta/info.json").read_text())["total_episodes"]
            assert whole_parts == 1 or ("are damaged" in capsys.readouterr().err and 1 < whole_parts < 10)
            _lerobot.shutil.rmtree(tmp_path / "set")
        else:
            assert "session" in capsys.readouterr().err
        assert [path.name for path in tmp_path.iterdir()] == ["session.mcap"]
    assert min(ends.values()) > 0, ends


def test_a_camera_that_says_no_size_and_a_picture_that_is_none_are_named(filmed, tmp_path, capsys):
    from mcap.reader import make_reader
    from mcap.writer import Writer

    def rewritten(path, metadata, change):
        with filmed.open("rb") as source, path.open("wb") as target:
            reader, writer, channels = make_reader(source), Writer(target), {}
            writer.start()
            for each in reader.iter_metadata():
                writer.add_metadata(each.name, each.metadata)
            for schema, channel, message in reader.iter_messages():
                camera = channel.topic.startswith("/camera/")
                if channel.topic not in channels:
                    number = writer.register_schema(schema.name, schema.encoding, schema.data)
                    channels[channel.topic] = writer.register_channel(channel.topic, channel.message_encoding, number, metadata if camera else channel.metadata)
                writer.add_message(channels[channel.topic], message.log_time, change(message.data) if camera else message.data, message.publish_time)
            writer.finish()

    size = {"width": "320", "height": "240", "rate_hz": "15"}
    for metadata, change in (({}, bytes), (size, lambda data: b"{}"), (size, lambda data: data[:20]), (size | {"width": "wide"}, bytes)):
        rewritten(tmp_path / "odd.mcap", metadata, change)
        assert make(tmp_path / "odd.mcap", "--out", tmp_path / "set", "--episodes", "session") == 2
        said = capsys.readouterr().err
        assert "odd.mcap: /camera/table has a message that is not a frame" in said and "Traceback" not in said


def test_a_conversion_that_is_killed_leaves_the_set_as_it_was_and_the_next_one_tidies_up(by_robot, tmp_path):
    words = [sys.executable, "-m", "steadyhand.dataset", by_robot["ur5e"], "--out", tmp_path / "set"]
    begin = time.monotonic()
    subprocess.run(words, check=True, env=ENVIRONMENT, capture_output=True, timeout=120)
    takes = time.monotonic() - begin
    draw = random.Random(3)
    episodes = 1
    for _ in range(8):
        process = subprocess.Popen(words, env=ENVIRONMENT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(draw.uniform(0.5, 1.1) * takes)
        process.send_signal(signal.SIGKILL)
        process.wait()
        info = json.loads((tmp_path / "set/meta/info.json").read_text())
        assert info["total_episodes"] in (episodes, episodes + 1)
        episodes = info["total_episodes"]
        frames = pd.concat([pd.read_parquet(path) for path in sorted((tmp_path / "set").glob("data/*/*.parquet"))])
        assert len(frames) == info["total_frames"] and frames["episode_index"].nunique() == episodes
    (tmp_path / ".set.being-written.of-a-run-that-died").mkdir()
    subprocess.run(words, check=True, env=ENVIRONMENT, capture_output=True, timeout=120)
    assert [path.name for path in tmp_path.iterdir()] == ["set"]


def test_where_folders_cannot_be_exchanged_the_set_is_put_in_place_all_the_same(by_robot, tmp_path, monkeypatch):
    monkeypatch.setattr(_lerobot, "_exchange", lambda *_: False)
    for count in (1, 2):
        assert make(by_robot["ur5e"], "--out", tmp_path / "set") == 0
        assert json.loads((tmp_path / "set/meta/info.json").read_text())["total_episodes"] == count
    assert [path.name for path in tmp_path.iterdir()] == ["set"]


def test_names_of_files_do_not_command_the_terminal(tmp_path, capsys):
    evil = tmp_path / "a\x1b]0;mine\x07\u009b2J.mcap"
    evil.write_bytes(b"no recording")
    assert command.main([str(evil), "--out", str(tmp_path / "set")]) == 2
    said = capsys.readouterr()
    assert "a\\x1b]0;mine\\x07\\xc2\\x9b2J.mcap" in said.err
    assert not any(c in said.out + said.err for c in "\x1b\x07\u009b")


def test_of_two_that_append_at_once_none_loses_its_episodes(by_robot, tmp_path):
    words = [sys.executable, "-m", "steadyhand.dataset", by_robot["ur5e"], "--out", tmp_path / "set"]
    at_once = [subprocess.Popen(words, env=ENVIRONMENT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) for _ in range(4)]
    for process in at_once:
        _, said = process.communicate(timeout=120)
        assert process.returncode == 0, said
    assert json.loads((tmp_path / "set/meta/info.json").read_text())["total_episodes"] == 4
    assert [path.name for path in tmp_path.iterdir()] == ["set"]


def test_two_robots_are_not_put_into_one_set(by_robot, tmp_path, capsys):
    assert make(by_robot["ur5e"], by_robot["ur3e"], "--out", tmp_path / "set") == 2
    assert "robot_type is ur3e; the first episode has ur5e: one data set holds one kind" in capsys.readouterr().err
    assert not any(tmp_path.iterdir())
    assert make(by_robot["ur5e"], "--out", tmp_path / "set") == 0
    assert make(by_robot["ur3e"], "--out", tmp_path / "set") == 2
    assert "robot_type is ur3e" in capsys.readouterr().err
    assert json.loads((tmp_path / "set/meta/info.json").read_text())["total_episodes"] == 1


@pytest.mark.parametrize("fps", [7, 30, 60, 499])
def test_rates_that_do_not_divide_500_hz_are_sampled_between(by_robot, fps):
    session = steadyhand.read_session(by_robot["ur5e"])
    (episode,), _ = dataset.cut(session, steadyhand.Robot("ur5e"), fps=fps)
    t = episode.start + np.arange(len(episode)) / fps
    for name, times, q in (("observation.state", t, session.states), ("action", t + 1 / fps, session.commands)):
        wanted = np.column_stack([np.interp(times, q.t, column) for column in q.q.T])
        np.testing.assert_allclose(episode.features[name].values[:, :6], wanted, atol=1e-9)
    assert t[-1] + 1 / fps <= session.commands.t[-1] + 1e-9


def test_an_episode_of_no_frames_is_left_out(by_robot):
    session = steadyhand.read_session(by_robot["ur5e"])
    marked = Marked(1, 1.0, 1.0, True, True, "do nothing", "")
    backwards, after = dataclasses.replace(marked, number=2, end=0.5), dataclasses.replace(marked, number=3, begin=100.0, end=101.0)
    episodes, left_out = dataset.cut(dataclasses.replace(session, episodes=[marked, backwards, after]), steadyhand.Robot("ur5e"), shortest=0.0)
    assert episodes == [] and len(left_out) == 3 and all("shorter than 0.0333333 s" in line for line in left_out), left_out


def test_a_task_whose_scene_lacks_what_it_names_moves_nothing(tmp_path):
    (tmp_path / "scene.xml").write_text('<mujoco><worldbody><body name="block"><freejoint/><geom size="0.02" mass="0.1"/></body></worldbody></mujoco>')
    (tmp_path / "task.yaml").write_text("instruction: x\nscene: scene.xml\nsuccess:\n  - {near: [block, goal], within: 0.1, height: 0.1}\n")
    done = demo(tmp_path / "sessions", "--arm", "mujoco", "--task", tmp_path / "task.yaml")
    if "without MuJoCo" in done.stderr:
        pytest.skip("built without MuJoCo: mujoco-core is not installed")
    assert done.returncode == 2 and f"names 'goal'; {tmp_path / 'scene.xml'} has no site and no body of that name" in done.stderr, done.stderr
    assert not (tmp_path / "sessions").exists()
