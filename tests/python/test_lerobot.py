"""Data sets as LeRobot's class reads them, in a repackaging (lerobot-dataset). In an environment of its own (.deps/lerobot), which ./steadyhand test --long makes."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pyarrow", reason="setup/requirements-dataset.txt is not installed")
from steadyhand import dataset  # noqa: E402
from steadyhand.dataset import Episode, Frames  # noqa: E402
from steadyhand.dataset._video import lay  # noqa: E402
from test_dataset_video import KEY, grey, video  # noqa: E402
from places import ROOT

READER = Path(os.environ.get("STEADYHAND_DEPS", ROOT / ".deps")) / "lerobot/bin/python"

# The data set's contents, as JSON; in batches as a training loop takes them.
READ = """
import json, sys, time
import torch, torchvision
torchvision.io.VideoReader.container = type("Container", (), {"close": lambda self: None})()  # Debian 12's 0.14 has none to close
from ledataset.datasets.lerobot_dataset import LeRobotDataset
begin = time.perf_counter()
data = LeRobotDataset("steadyhand/test", root=sys.argv[1], video_backend="pyav", delta_timestamps={"action": [0.0, 1 / 30]})
opened = time.perf_counter() - begin
batch = next(iter(torch.utils.data.DataLoader(data, batch_size=4)))
rows = [data[i] for i in (0, len(data) - 1)]
print(json.dumps({
    "opened_s": opened, "fps": data.fps, "episodes": data.num_episodes, "frames": data.num_frames, "robot": data.meta.robot_type,
    "tasks": [row["task"] for row in rows], "success": [bool(row["next.success"]) for row in rows],
    "state": [row["observation.state"].tolist() for row in rows], "action": [row["action"].tolist() for row in rows],
    "padded": [row["action_is_pad"].tolist() for row in rows], "batch": {key: list(value.shape) for key, value in batch.items() if hasattr(value, "shape")},
    "mean": data.meta.stats["action"]["mean"].tolist(),
    "cameras": data.meta.camera_keys, "picture": list(rows[0]["observation.images.front"].shape) if data.meta.camera_keys else [],
    "greys": [round(255 * float(data[i]["observation.images.front"].mean())) for i in range(len(data))] if data.meta.camera_keys else []}))
"""


def episode(number, frames, random, films=None):
    t = np.arange(frames) / 30
    state = random.normal(size=(frames, 12))
    action = np.cumsum(random.normal(size=(frames, 6)), axis=0)
    features = {
        "observation.state": Frames(state, tuple(f"j{k}.{kind}" for kind in ("pos", "vel") for k in range(6))),
        "action": Frames(action, tuple(f"j{k}.pos" for k in range(6))),
        "next.success": Frames((t == t[-1])[:, None] & (number % 2 == 0), ("success",), "bool"),
    }
    return Episode(f"session-{number}", 0.0, 30, "ur5e", f"task {number % 2}", features, number % 2 == 0, films=films or {})


def read(folder, beside):
    """What it finds in the data set `folder`."""
    done = subprocess.run([READER, "-I", "-c", READ, folder], capture_output=True, text=True, timeout=600, cwd=beside,
                          env={**os.environ, "HF_HUB_OFFLINE": "1", "HF_HOME": str(beside / "cache")})  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.long
@pytest.mark.skipif(not READER.exists(), reason="no .deps/lerobot: setup/apt-lerobot.txt or setup/requirements-lerobot.txt is not installed")
def test_its_own_class_opens_what_we_write(tmp_path):
    random = np.random.default_rng(1)
    episodes = [episode(number, 40 + 10 * number, random) for number in range(3)]
    dataset.write(tmp_path / "set", episodes[:2])
    dataset.write(tmp_path / "set", episodes[2:])  # appended
    found = read(tmp_path / "set", tmp_path)
    assert (found["fps"], found["episodes"], found["frames"], found["robot"]) == (30, 3, 150, "ur5e")
    assert found["tasks"] == ["task 0", "task 0"] and found["success"] == [False, True]
    first, last = episodes[0].features, episodes[2].features
    np.testing.assert_allclose(found["state"], [first["observation.state"].values[0], last["observation.state"].values[-1]], rtol=1e-6)
    np.testing.assert_allclose(found["action"][0], first["action"].values[:2], rtol=1e-6)
    assert found["padded"] == [[False, False], [False, True]]  # nothing follows the last frame
    assert found["batch"]["action"] == [4, 2, 6]
    np.testing.assert_allclose(found["mean"], np.vstack([each.features["action"].values for each in episodes]).mean(axis=0), rtol=1e-5)


@pytest.mark.long
@pytest.mark.skipif(not READER.exists(), reason="no .deps/lerobot: setup/apt-lerobot.txt or setup/requirements-lerobot.txt is not installed")
def test_its_own_class_shows_our_pictures(tmp_path):
    random = np.random.default_rng(1)
    filmed = video(0.1 + np.arange(30) / 15)
    begins = (0.21, 0.91, 0.41)
    films = [lay("front", filmed, begin + np.arange(20) / 30) for begin in begins]
    episodes = [episode(number, 20, random, {KEY: film}) for number, film in enumerate(films)]
    dataset.write(tmp_path / "set", episodes[:2])
    dataset.write(tmp_path / "set", episodes[2:])  # in a separate file
    found = read(tmp_path / "set", tmp_path)
    assert found["cameras"] == [KEY] and found["picture"] == [3, 48, 64]
    shown = [grey(int(np.argmin(np.abs(np.array(filmed.t) - t)))) for begin in begins for t in begin + np.arange(20) / 30]
    np.testing.assert_allclose(found["greys"], shown, atol=2.9)  # 6 apart
    for name, each in (("one", episodes[:2]), ("other", episodes[2:])):
        dataset.write(tmp_path / name, each)
    dataset.merge(tmp_path / "merged", [tmp_path / "one", tmp_path / "other"])
    assert read(tmp_path / "merged", tmp_path) | {"opened_s": 0} == found | {"opened_s": 0}
