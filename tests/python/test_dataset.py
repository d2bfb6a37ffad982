"""Data sets of recorded sessions (docs/how-to/record-data.md), held against what an independent reader finds in the recordings."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from sample import PROGRAM

pd = pytest.importorskip("pandas", reason="setup/requirements-dataset.txt is not installed")
pytest.importorskip("pyarrow", reason="setup/requirements-dataset.txt is not installed")
import steadyhand  # noqa: E402
from steadyhand import dataset  # noqa: E402
from steadyhand.dataset import __main__ as command  # noqa: E402


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A hand that grips, lets go, grips for too short, and grips again."""
    folder = tmp_path_factory.mktemp("recorded")
    t = np.arange(0.0, 7.0, 1 / 90)
    clutch = ((t < 3.0) | ((t > 3.5) & (t < 3.8)) | (t > 4.5)).astype(int)
    rows = [f"{at:.5f},{0.2 * np.sin(2 * at):.6f},{0.1 * np.sin(3 * at):.6f},1.2,0,0,0,1,{held}" for at, held in zip(t, clutch)]
    (folder / "hand.csv").write_text("t,px,py,pz,qx,qy,qz,qw,clutch\n" + "\n".join(rows) + "\n")
    subprocess.run(
        [PROGRAM, "replay", folder / "hand.csv", "--profile", "carry", "--rate", "50", "--out", folder / "out"], check=True, capture_output=True, timeout=600
    )
    return folder / "out/carry/session.mcap"


@pytest.fixture(scope="module")
def joints(recorded):
    """Of commands and of measured states as the mcap package reads them: t in s, q."""
    found = {"/joint_command": [], "/joint_state": []}
    with recorded.open("rb") as file:
        for _, channel, message in make_reader(file).iter_messages(topics=list(found)):
            said = json.loads(message.data)
            found[channel.topic].append((said["timestamp"]["sec"] + 1e-9 * said["timestamp"]["nsec"], said["q"]))
    return {topic: (np.array([t for t, _ in rows]), np.array([q for _, q in rows])) for topic, rows in found.items()}


def at(joints, topic, t):
    times, q = joints[topic]
    return np.column_stack([np.interp(t, times, column) for column in q.T])


def frames(folder):
    return pd.concat([pd.read_parquet(path) for path in sorted(folder.glob("data/*/*.parquet"))])


def column(table, name):
    return np.array(table[name].tolist())


def make(*words):
    return command.main([str(word) for word in words])


def test_grips_become_episodes_on_one_clock(recorded, joints, tmp_path, capsys):
    assert make(recorded, "--out", tmp_path / "set", "--fps", 25, "--task", "carry the glass") == 0
    said = capsys.readouterr()
    assert "2 episodes" in said.out and "shorter than 1 s" in said.err
    info = json.loads((tmp_path / "set/meta/info.json").read_text())
    table = frames(tmp_path / "set")
    assert (info["total_episodes"], info["total_frames"], info["fps"], info["robot_type"]) == (2, len(table), 25, "ur5e")
    episodes = pd.read_parquet(next((tmp_path / "set/meta/episodes").rglob("*.parquet")))
    for _, episode in episodes.iterrows():
        rows = table[table["episode_index"] == episode["episode_index"]]
        assert len(rows) == episode["length"] and list(rows["index"]) == list(range(episode["dataset_from_index"], episode["dataset_to_index"]))
        t = episode["session_start_s"] + np.arange(len(rows)) / 25
        assert np.allclose(rows["timestamp"], np.arange(len(rows)) / 25, atol=1e-6)
        state, action = column(rows, "observation.state"), column(rows, "action")
        assert np.abs(state[:, :6] - at(joints, "/joint_state", t)).max() < 1e-5
        assert np.abs(action - at(joints, "/joint_command", t + 1 / 25)).max() < 1e-5
        assert np.abs(action - state[:, :6]).max() > 1e-3, "an action is no copy of the state"
        stats = np.array(episode["stats/action/q50"])
        assert np.allclose(stats, np.quantile(action, 0.5, axis=0), atol=1e-6)
    tasks = pd.read_parquet(tmp_path / "set/meta/tasks.parquet")
    assert list(tasks.index) == ["carry the glass"] and list(tasks["task_index"]) == [0]


@pytest.mark.parametrize("action, width", [("delta", 6), ("pose", 7), ("command", 12)])
def test_other_actions(recorded, joints, tmp_path, action, width):
    assert make(recorded, "--out", tmp_path / "set", "--action", action) == 0
    table = frames(tmp_path / "set")
    values = column(table, "action")
    assert values.shape[1] == width == len(json.loads((tmp_path / "set/meta/info.json").read_text())["features"]["action"]["names"])
    if action == "delta":  # adds up to the whole way
        first = table[table["episode_index"] == 0]
        assert np.abs(at(joints, "/joint_command", [len(first) / 30])[0] - at(joints, "/joint_command", [0.0])[0] - column(first, "action").sum(axis=0)).max() < 1e-2
    if action == "pose":
        assert np.allclose(np.linalg.norm(values[:, 3:], axis=1), 1.0, atol=1e-6)


def damaged(recorded, path, share):
    """A copy with one byte changed in the chunk at this share of the file."""
    content = bytearray(recorded.read_bytes())
    content[content.index(b"\x04\0\0\0zstd", int(share * len(content))) + 500] ^= 0xFF
    path.write_bytes(content)
    return path


def test_a_damaged_chunk_costs_its_half_second_only(recorded, tmp_path, capsys):
    path = damaged(recorded, tmp_path / "damaged.mcap", 0.15)  # within the first of the grips
    (loss,) = steadyhand.read_session(path).lost
    assert 0.0 < loss.begin < loss.end < min(3.0, loss.begin + 0.7)
    assert make(path, "--out", tmp_path / "set", "--shortest", 0.2) == 0
    said = capsys.readouterr()
    assert "4 episodes" in said.out and f"{loss.reason}\n" in said.err and "checksum" in loss.reason, said
    begins = pd.concat(pd.read_parquet(file) for file in (tmp_path / "set/meta/episodes").rglob("*.parquet"))["session_start_s"]
    assert np.abs(begins.iloc[1] - loss.end) < 0.03 < begins.iloc[2]
    report = subprocess.run([PROGRAM, "report", path], capture_output=True, text=True, timeout=60)
    assert report.returncode == 0 and loss.reason in report.stderr and "the file is damaged at byte" in path.with_suffix(".html").read_text()


def test_appends_and_refuses_what_is_of_another_kind(recorded, tmp_path, capsys):
    assert make(recorded, "--out", tmp_path / "set", "--task", "one") == 0
    assert make(recorded, "--out", tmp_path / "set", "--task", "two", "--episodes", "session") == 0
    table = frames(tmp_path / "set")
    assert list(table["index"]) == list(range(len(table))) and sorted(set(table["task_index"])) == [0, 1]
    stats = json.loads((tmp_path / "set/meta/stats.json").read_text())["observation.state"]
    assert stats["count"] == [len(table)] and np.allclose(stats["mean"], column(table, "observation.state").mean(axis=0), atol=1e-6)
    capsys.readouterr()
    before = {path: path.read_bytes() for path in (tmp_path / "set").rglob("*") if path.is_file()}
    for words, reason in ((["--fps", 20], "fps"), (["--action", "pose"], "action differs")):
        assert make(recorded, "--out", tmp_path / "set", *words) == 2
        assert reason in capsys.readouterr().err
    assert before == {path: path.read_bytes() for path in (tmp_path / "set").rglob("*") if path.is_file()}
    assert [path.name for path in tmp_path.iterdir()] == ["set"]


def test_what_is_interrupted_leaves_all_as_it_was(recorded, tmp_path, monkeypatch):
    assert make(recorded, "--out", tmp_path / "set") == 0
    before = {path: path.read_bytes() for path in (tmp_path / "set").rglob("*") if path.is_file()}

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(sys.modules["steadyhand.dataset._lerobot"], "_write_json", full)
    assert make(recorded, "--out", tmp_path / "set") == 2
    assert before == {path: path.read_bytes() for path in (tmp_path / "set").rglob("*") if path.is_file()}
    assert [path.name for path in tmp_path.iterdir()] == ["set"]


whole = command._episodes_of


def deadly(path, **more):
    """In a worker's place: the session of this name kills it."""
    if path.name == "deadly.mcap":
        os.kill(os.getpid(), signal.SIGKILL)
    return whole(path, **more)


def test_a_broken_session_and_a_worker_that_is_killed_take_no_other_with_them(recorded, tmp_path, monkeypatch, capsys):
    for name in ("a", "deadly", "z"):
        (tmp_path / f"{name}.mcap").write_bytes(recorded.read_bytes())
    (tmp_path / "broken.mcap").write_bytes(recorded.read_bytes()[:100])
    monkeypatch.setattr(command, "_episodes_of", deadly)
    assert make(tmp_path, "--out", tmp_path / "set", "--workers", 2) == 0
    said = capsys.readouterr()
    assert "4 episodes" in said.out and "broken.mcap" in said.err and "deadly.mcap: the process that read it was killed" in said.err


@pytest.mark.parametrize("words, reason", [
    (["nowhere.mcap", "--out", "set"], "nowhere.mcap: there is no such file"),
    (["SESSION", "SESSION", "--out", "set"], "named twice"),
    (["SESSION"], "--out"),
    (["SESSION", "--out", "set", "--fps", "0"], "--fps is 0; it must be a whole number from 1 to 500"),
    (["SESSION", "--out", "set", "--fps", "29.97"], "--fps is 29.97; data sets have whole numbers, such as 30"),
    (["SESSION", "--out", "set", "--fps", "nan"], "--fps is nan; it must be"),
    (["SESSION", "--out", "set", "--fps", "many"], "--fps is many; it must be"),
    (["SESSION", "--out", "set", "--action", "torque"], "torque"),
    (["SESSION", "--out", "set", "--workers", "0"], "--workers is 0"),
    (["SESSION", "--out", "set", "--shortest", "nan"], "--shortest is nan"),
    (["SESSION", "--out", "set", "--picture-pause", "0"], "--picture-pause is 0"),
    (["SESSION", "--out", "set", "--picture-pause", "nan"], "--picture-pause is nan"),
    (["SESSION", "--out", "set", "--shortest", "1000"], "there is no episode to write"),
    (["SESSION", "--out", "set", "--robot", "ur6"], "ur6"),
    (["SESSION", "--out", "set", "--robot", "gen3"], "the robot gen3 has"),
    (["HAND", "--out", "set"], "hand.csv"),
    (["SESSION", "--out", "OTHER"], "no data set"),
    (["SESSION", "--out", "FILE"], "notes.txt is a file; a data set is a folder"),
])  # fmt: skip
def test_bad_input(recorded, tmp_path, monkeypatch, capsys, words, reason):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "other").mkdir()
    (tmp_path / "other/notes.txt").write_text("mine")
    names = {"SESSION": str(recorded), "HAND": str(recorded.parents[2] / "hand.csv"), "OTHER": "other", "FILE": "other/notes.txt"}
    assert make(*(names.get(word, word) for word in words)) == 2
    assert reason in capsys.readouterr().err
    assert (tmp_path / "other/notes.txt").read_text() == "mine"
    assert not Path("set").exists() and os.listdir("other") == ["notes.txt"]


def test_episodes_in_python(recorded):
    session = steadyhand.read_session(recorded)
    episodes, left_out = dataset.cut(session, steadyhand.Robot("ur5e"), fps=10, shortest=0.0)
    assert [len(episode) for episode in episodes] and not left_out and all(episode.fps == 10 for episode in episodes)
    with pytest.raises(ValueError, match="fps is 0"):
        dataset.cut(session, steadyhand.Robot("ur5e"), fps=0)


def test_robomimics_file_has_the_same_numbers(recorded, tmp_path, capsys):
    h5py = pytest.importorskip("h5py", reason="setup/requirements-dataset.txt is not installed")
    make(recorded, "--out", tmp_path / "set", "--task", "wave")
    make(recorded, "--out", tmp_path / "set.hdf5", "--task", "wave", "--format", "robomimic")
    table = frames(tmp_path / "set")
    with h5py.File(tmp_path / "set.hdf5") as file:
        demos = sorted(file["data"], key=lambda name: int(name[5:]))
        assert demos == [f"demo_{k}" for k in range(table["episode_index"].nunique())]
        assert file["data"].attrs["total"] == sum(file["data"][name].attrs["num_samples"] for name in demos) == len(table) - len(demos)
        assert json.loads(file["data"].attrs["env_args"])["env_kwargs"] == {"robot": "ur5e", "fps": 30}
        for k, name in enumerate(demos):
            demo, of = file["data"][name], table[table["episode_index"] == k]
            assert len(demo["actions"]) == demo.attrs["num_samples"] == len(of) - 1 and demo.attrs["task"] == "wave"
            np.testing.assert_array_equal(demo["actions"], column(of, "action")[:-1])
            for key, feature in (("state", "observation.state"), ("tool", "observation.tool"), ("operator_target", "operator.target")):
                np.testing.assert_array_equal(demo["obs"][key], column(of, feature)[:-1])
                np.testing.assert_array_equal(demo["next_obs"][key], column(of, feature)[1:])
            assert demo["obs/policy"].shape == demo["obs/intervention"].shape == (len(of) - 1, 1)
            assert list(demo["obs/tool"].attrs["names"])[0] == "tool.x"
            assert demo["dones"][-1] == 1 and not demo["dones"][:-1].any() and not np.any(demo["rewards"])
    for out, more, words in (("set.hdf5", [], "set.hdf5 is there already"), ("none.hdf5", ["--shortest", "1000"], "there is no episode")):
        assert make(recorded, "--out", tmp_path / out, "--format", "robomimic", *more) == 2
        assert words in capsys.readouterr().err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["set", "set.hdf5"]
