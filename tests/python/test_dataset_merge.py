"""Finished data sets merged into one (docs/how-to/record-data.md), held against the set that is made of all episodes at once."""

import json
import re
import shutil

import numpy as np
import pytest

av = pytest.importorskip("av", reason="setup/requirements-dataset.txt is not installed")
pd = pytest.importorskip("pandas", reason="setup/requirements-dataset.txt is not installed")
import pyarrow as pa  # noqa: E402
import pyarrow.parquet as pq  # noqa: E402
from steadyhand import dataset  # noqa: E402
from steadyhand.dataset import Episode, Frames  # noqa: E402
from steadyhand.dataset import __main__ as command  # noqa: E402
from steadyhand.dataset._video import lay  # noqa: E402
from test_dataset_video import KEY, shown, video  # noqa: E402

FILMED = video(np.arange(30) / 15)


def episode(number, task="a task", fps=30, robot="ur5e", filmed=True, names="abcdef"):
    random = np.random.default_rng(number)
    frames = 10 + number
    features = {"observation.state": Frames(random.normal(size=(frames, len(names))), tuple(names)), "action": Frames(random.normal(size=(frames, 6)), tuple("abcdef"))}
    films = {KEY: lay("front", FILMED, 0.2 + 0.1 * number + np.arange(frames) / 30)} if filmed else {}
    return Episode(f"session-{number}", 0.5 * number, fps, robot, task, features, number % 2 == 0, f"note {number}", films=films)


EPISODES = [episode(0, "push"), episode(1, "carry"), episode(2, "stack"), episode(3, "carry"), episode(4, "push")]


def make(*words):
    return command.main([str(word) for word in words])


def table(folder, kind):
    return pa.concat_tables(pq.read_table(path) for path in sorted(folder.glob(f"{kind}/*/*.parquet")))


def is_place(name):
    """Of a file, or of when an episode begins in it: they are others where files are."""
    return re.search(r"(chunk_index|file_index|_timestamp)$", name) is not None


def contents(folder):
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture
def sets(tmp_path):
    """Three sets, the first in two files of each kind, and where to merge them."""
    dataset.write(tmp_path / "one", EPISODES[:1])
    dataset.write(tmp_path / "one", EPISODES[1:2])
    dataset.write(tmp_path / "two", EPISODES[2:4])
    dataset.write(tmp_path / "three", EPISODES[4:])
    return [tmp_path / name for name in ("one", "two", "three")]


def test_what_is_merged_is_what_is_made_at_once(sets, tmp_path, capsys):
    before = [contents(each) for each in sets]
    assert make(*sets, "--out", tmp_path / "merged") == 0
    assert "5 and 60 frames in all" in capsys.readouterr().out
    dataset.write(tmp_path / "whole", EPISODES)
    merged, whole = tmp_path / "merged", tmp_path / "whole"
    assert table(merged, "data").equals(table(whole, "data"))
    rows, expected = (table(folder, "meta/episodes").to_pandas() for folder in (merged, whole))
    assert list(rows.columns) == list(expected.columns)
    for name in rows.columns:
        if not is_place(name):
            assert [np.asarray(value).tolist() for value in rows[name]] == [np.asarray(value).tolist() for value in expected[name]], name
    for name in ("meta/info.json", "meta/stats.json"):
        assert json.loads((merged / name).read_text()) == json.loads((whole / name).read_text()), name
    assert pd.read_parquet(merged / "meta/tasks.parquet").equals(pd.read_parquet(whole / "meta/tasks.parquet"))
    all_at_once = [picture for _, picture in shown(whole / f"videos/{KEY}/chunk-000/file-000.mp4")]
    for _, row in rows.iterrows():  # each finds its pictures where its row says
        film = shown(merged / f"videos/{KEY}/chunk-{row[f'videos/{KEY}/chunk_index']:03d}/file-{row[f'videos/{KEY}/file_index']:03d}.mp4")
        first, last = (round(30 * row[f"videos/{KEY}/{end}_timestamp"]) for end in ("from", "to"))
        for (_, picture), other in zip(film[first:last], all_at_once[row["dataset_from_index"] : row["dataset_to_index"]], strict=True):
            assert np.abs(picture.astype(int) - other).mean() < 3
    assert before == [contents(each) for each in sets]


def test_a_set_that_is_there_is_appended_to_and_can_be_again(sets, tmp_path):
    assert make(sets[1], sets[2], "--out", sets[0]) == 0
    dataset.write(sets[0], [episode(5, "push")])
    frames = table(sets[0], "data")
    assert frames["index"].to_pylist() == list(range(75)) and frames["episode_index"].to_pylist()[-15:] == [5] * 15
    assert json.loads((sets[0] / "meta/info.json").read_text())["total_tasks"] == 3
    videos = sorted(sets[0].glob("videos/*/*/*.mp4"))
    assert [len(shown(path)) for path in videos] == [10, 11, 25, 14, 15]


def cut_off(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


DAMAGES = {
    "no frames": (lambda folder: (folder / "data/chunk-000/file-000.parquet").unlink(), "file-000.parquet: is missing"),
    "frames cut off": (lambda folder: cut_off(folder / "data/chunk-000/file-000.parquet"), "data/chunk-000/file-000.parquet: "),
    "episodes cut off": (lambda folder: cut_off(folder / "meta/episodes/chunk-000/file-000.parquet"), "meta/episodes/chunk-000/file-000.parquet: "),
    "no episodes": (lambda folder: (folder / "meta/episodes/chunk-000/file-000.parquet").unlink(), "info.json says 2"),
    "no tasks": (lambda folder: (folder / "meta/tasks.parquet").unlink(), "tasks.parquet: is missing"),
    "no video": (lambda folder: (folder / f"videos/{KEY}/chunk-000/file-000.mp4").unlink(), "file-000.mp4: is missing"),
    "video cut off": (lambda folder: cut_off(folder / f"videos/{KEY}/chunk-000/file-000.mp4"), "file-000.mp4: "),
    "info cut off": (lambda folder: cut_off(folder / "meta/info.json"), "info.json: "),
    "frames of another": (lambda folder: shutil.copy(folder.parent / "one/data/chunk-000/file-000.parquet", folder / "data/chunk-000/file-000.parquet"), "has 10 frames; its episodes have 25"),
}  # fmt: skip


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_set_that_lacks_something_is_named_and_nothing_is_written(sets, tmp_path, capsys, damage):
    act, reason = DAMAGES[damage]
    act(sets[1])
    before = contents(sets[0])
    for out in (sets[0], tmp_path / "merged"):
        words = [sets[1], sets[2]] if out == sets[0] else sets
        assert make(*words, "--out", out) == 2
        said = capsys.readouterr().err
        assert reason in said and str(sets[1]) in said
    assert contents(sets[0]) == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one", "three", "two"]


@pytest.mark.parametrize("other, reason", [
    ({"fps": 20, "filmed": False}, "fps"), ({"robot": "fr3", "filmed": False}, "robot_type is fr3"), ({}, "has observation.images.front"),
    ({"filmed": False, "names": "abc"}, "observation.state differs"),
])  # fmt: skip
def test_what_is_of_another_kind_is_refused(tmp_path, capsys, other, reason):
    dataset.write(tmp_path / "one", [episode(0, filmed=False)])
    dataset.write(tmp_path / "other", [episode(1, **other)])
    before = contents(tmp_path / "one")
    assert make(tmp_path / "one", tmp_path / "other", "--out", tmp_path / "merged") == 2
    assert reason in capsys.readouterr().err
    assert make(tmp_path / "other", "--out", tmp_path / "one") == 2
    assert reason in capsys.readouterr().err
    assert contents(tmp_path / "one") == before and sorted(path.name for path in tmp_path.iterdir()) == ["one", "other"]


def test_a_set_is_taken_once_and_whole(sets, tmp_path, capsys):
    for words, reason in (([sets[0], sets[0]], "named twice"), ([sets[0], "--no-video"], "--no-video"), ([sets[0], "--format", "rerun"], "--format")):
        assert make(*words, "--out", tmp_path / "merged") == 2
        assert reason in capsys.readouterr().err
    assert make(sets[0], "--out", sets[0]) == 2
    assert "named twice" in capsys.readouterr().err
