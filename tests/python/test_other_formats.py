"""Data sets in other formats as their own readers read them: robomimic's in an environment of its own (.deps/lerobot), Rerun's SDK beside
the tests; both are there with ./steadyhand test --long.
"""

import json
import subprocess

import numpy as np
import pytest

pytest.importorskip("pyarrow", reason="setup/requirements-dataset.txt is not installed")
av = pytest.importorskip("av", reason="setup/requirements-dataset.txt is not installed")
from steadyhand.dataset import Episode, Frames  # noqa: E402
from steadyhand.dataset._video import lay  # noqa: E402
from test_dataset_video import KEY, grey, video  # noqa: E402
from test_lerobot import READER  # noqa: E402

# Sequences of four with two frames stacked, and normalised ones, as training loops take them.
ROBOMIMIC = """
import json, sys
import numpy as np, torch
from robomimic.utils import obs_utils
from robomimic.utils.dataset import SequenceDataset
keys = ("state", "tool", "policy")
obs_utils.initialize_obs_utils_with_obs_specs([{"obs": {"low_dim": list(keys), "rgb": []}}])
data = SequenceDataset(sys.argv[1], obs_keys=keys, dataset_keys=("actions", "rewards", "dones"), seq_length=4, frame_stack=2, hdf5_cache_mode="all")
normal = SequenceDataset(sys.argv[1], obs_keys=keys, dataset_keys=("actions",), hdf5_cache_mode="low_dim", hdf5_normalize_obs=True)
plain = SequenceDataset(sys.argv[1], obs_keys=keys, dataset_keys=("actions", "rewards", "dones"), hdf5_cache_mode=None)
last = plain[len(plain) - 1]
batch = next(iter(torch.utils.data.DataLoader(data, batch_size=8, shuffle=True)))
print(json.dumps({
    "length": len(plain), "demos": list(plain.demos), "actions": [plain[i]["actions"][0].tolist() for i in range(len(plain))],
    "next": np.asarray(last["next_obs"]["state"][0]).tolist(), "rewards": [float(plain[i]["rewards"][0]) for i in range(len(plain))],
    "batch": {"actions": list(batch["actions"].shape), "state": list(batch["obs"]["state"].shape)},
    "finite": all(bool(np.isfinite(normal[i]["obs"][key]).all()) for key in keys for i in range(len(normal))),
    "mean": float(np.mean([normal[i]["obs"]["state"] for i in range(len(normal))]))}))
"""


def episode(number, frames, film=None):
    random = np.random.default_rng(number)
    tool = np.hstack([random.normal(size=(frames, 3)), np.tile([0.0, 0.6, 0.0, 0.8], (frames, 1))])
    features = {
        "observation.state": Frames(random.normal(size=(frames, 12)), tuple(f"j{k}.{kind}" for kind in ("pos", "vel") for k in range(6))),
        "observation.tool": Frames(tool, tuple(f"tool.{name}" for name in ("x", "y", "z", "qx", "qy", "qz", "qw"))),
        "action": Frames(random.normal(size=(frames, 6)), tuple(f"j{k}.pos" for k in range(6))),
        "policy": Frames(np.zeros((frames, 1), dtype=bool), ("policy",), "bool"),
        "next.success": Frames((np.arange(frames) == frames - 1)[:, None], ("success",), "bool"),
    }
    return Episode(f"session-{number}", 1.5, 30, "ur5e", "a task", features, True, "gently" if number else "", {KEY: film} if film else {})


@pytest.mark.long
@pytest.mark.skipif(not READER.exists(), reason="no .deps/lerobot: setup/apt-lerobot.txt or setup/requirements-lerobot.txt is not installed")
def test_robomimics_own_reader_takes_sequences_of_our_file(tmp_path):
    from steadyhand.dataset._robomimic import write_robomimic

    episodes = [episode(0, 40), episode(1, 25)]
    assert write_robomimic(tmp_path / "set.hdf5", episodes) == 63
    done = subprocess.run([READER, "-I", "-c", ROBOMIMIC, tmp_path / "set.hdf5"], capture_output=True, text=True, timeout=600, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    assert (found["length"], found["demos"]) == (63, ["demo_0", "demo_1"])
    wanted = np.vstack([each.features["action"].values[:-1] for each in episodes]).astype(np.float32)
    np.testing.assert_array_equal(np.array(found["actions"], dtype=np.float32), wanted)
    np.testing.assert_allclose(found["next"], episodes[1].features["observation.state"].values[-1], rtol=1e-6)
    assert [k for k, reward in enumerate(found["rewards"]) if reward] == [38, 62]
    assert found["batch"] == {"actions": [8, 5, 6], "state": [8, 5, 12]} and found["finite"] and abs(found["mean"]) < 0.01


def read_rrd(path):
    """By entity: columns as arrays; and what properties say."""
    from rerun.chunk import RrdReader

    found = {}
    for chunk in RrdReader(path).stream().to_chunks():
        batch = chunk.to_record_batch()
        of = found.setdefault(str(chunk.entity_path).lstrip("/"), {})
        for name, column in zip(batch.schema.names, batch.columns):
            of.setdefault(name, []).extend(column.to_pylist())
    return found


@pytest.mark.long
def test_reruns_own_reader_has_our_numbers_names_and_pictures(tmp_path):
    pytest.importorskip("rerun", reason="setup/requirements-rerun.txt is not installed")
    from steadyhand.dataset._rerun import write_rerun

    filmed = video(0.1 + np.arange(30) / 15)
    film = lay("front", filmed, 0.41 + np.arange(20) / 30)
    episodes = [episode(0, 20, film), episode(1, 25)]
    assert write_rerun(tmp_path / "set", episodes) == 45
    assert sorted(path.name for path in (tmp_path / "set").iterdir()) == ["session-0-000.rrd", "session-1-001.rrd"]
    for each, path in zip(episodes, sorted((tmp_path / "set").iterdir())):
        found = read_rrd(path)
        for name, frames in each.features.items():
            np.testing.assert_allclose(found[name]["Scalars:scalars"], frames.values.astype(float), rtol=1e-12)
            assert found[name]["SeriesLines:names"] == [list(frames.names)]
            assert found[name]["frame"] == list(range(len(each)))
            np.testing.assert_allclose([t.total_seconds() for t in found[name]["episode"]], np.arange(len(each)) / 30, atol=1e-6)
        tool = each.features["observation.tool"].values
        np.testing.assert_allclose(np.ravel(found["world/tool"]["Transform3D:translation"]), tool[:, :3].ravel(), rtol=1e-6)
        np.testing.assert_allclose(np.ravel(found["world/tool"]["Transform3D:quaternion"]), tool[:, 3:].ravel(), rtol=1e-6)
        about = found["__properties/steadyhand"]
        assert about["success"] == [["true"]] and about["task"] == [["a task"]] and about["session"] == [[each.session]]
    shown = read_rrd(tmp_path / "set/session-0-000.rrd")[KEY]
    np.testing.assert_allclose([t.total_seconds() for t in shown["episode"]], film.t, atol=1e-6)
    decoder = av.CodecContext.create("h264", "r")
    decoder.flags |= av.codec.context.Flags.low_delay
    pictures = [frame.to_ndarray(format="rgb24").mean() for packet in shown["VideoStream:sample"] for frame in decoder.decode(av.Packet(bytes(packet[0])))]
    exposed = [int(np.argmin(np.abs(np.array(filmed.t) - 0.41 - t))) for t in film.t]
    np.testing.assert_allclose(pictures, [grey(k) for k in exposed], atol=2.9)  # 6 apart
    with pytest.raises(ValueError, match="set is there already"):
        write_rerun(tmp_path / "set", episodes)
    with pytest.raises(ValueError, match="there is no episode"):
        write_rerun(tmp_path / "none", [])
    assert [path.name for path in tmp_path.iterdir()] == ["set"]
