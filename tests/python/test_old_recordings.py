"""Recordings made with version 0.2 open in the report, the replay, Python and the data set, with the figures that they had then."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from sample import PROGRAM

import steadyhand

RECORDINGS = Path(__file__).resolve().parents[1] / "files/record/recordings"
NAMES = ("replay", "live", "cell")


def run(*words):
    environment = {**os.environ, "STEADYHAND_PROGRAM": PROGRAM, "PYTHONPATH": str(Path(PROGRAM).parent / "python")}
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True, timeout=120, env=environment)
    assert done.returncode == 0, done.stderr
    return done.stdout


def figures(printed):
    """Of the table that `report` and `replay` print: by its row, a number for each profile."""
    rows = re.findall(r"^  (\S.*?)  +(?:m/s²|mm|°|%|ms)?((?: +[\d.]+)+)$", printed, re.MULTILINE)
    return {name: [float(number) for number in numbers.split()] for name, numbers in rows}


REPORTED = {
    "replay": {
        "Lateral specific force, mean": [0.48], "Vertical specific force, smallest": [7.02], "Position error, RMS": [14.0],
        "Orientation error, largest": [25.76], "Distance between bodies, smallest": [14.2], "Distance to objects, smallest": [88.9],
        "Joint speed, largest of limit": [27.8], "Plans looked at": [23], "Failures": [0], "Solve time, largest": [1.992],
    },
    "live": {
        "Lateral specific force, mean": [0.29, 0.43], "Vertical specific force, smallest": [5.12, 5.68], "Spills": [0, 0], "Position error, RMS": [7.2, 40.1],
        "Orientation error, largest": [2.19, 2.76], "Distance between bodies, smallest": [13.2, 13.3], "Distance to objects, smallest": [88.4, 88.4],
        "Joint speed, largest of limit": [25.6, 23.7], "Plans looked at": [31, 5], "Failures": [0, 0], "Solve time, largest": [0.752, 0.687],
    },
    "cell": {
        "Lateral specific force, mean": [0.36, 0.08], "Vertical specific force, smallest": [7.55, 9.69], "Spills": [0, 0], "Position error, RMS": [12.9, 7.7],
        "Orientation error, largest": [3.04, 1.40], "Distance between bodies, smallest": [13.2, 13.3], "Distance to objects, smallest": [68.4, 68.4],
        "Joint speed, largest of limit": [23.9, 4.7], "Plans looked at": [22, 28], "Failures": [0, 0], "Solve time, largest": [0.551, 0.106],
    },
}  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_it_is_reported(name, tmp_path):
    page = tmp_path / "report.html"
    said = figures(run(PROGRAM, "report", RECORDINGS / f"{name}.mcap", "--out", page))
    assert {row: said.get(row) for row in REPORTED[name]} == REPORTED[name]
    assert "carry" in page.read_text().lower()


@pytest.mark.parametrize(
    ("name", "plans", "error", "to_objects"), [("replay", 22, 8.5, 88.9), ("live", 73, 10.0, 88.9), ("cell", 120, 7.0, 68.9)], ids=NAMES
)
def test_its_hand_is_replayed_as_it_was_set_up(name, plans, error, to_objects, tmp_path):
    said = figures(run(PROGRAM, "replay", RECORDINGS / f"{name}.mcap", "--out", tmp_path))
    assert said["Plans looked at"] == [plans] and said["Failures"] == [0]
    assert said["Position error, RMS"] == pytest.approx([error], abs=0.2)
    assert said["Distance to objects, smallest"] == pytest.approx([to_objects], abs=0.2)


READ = {
    "replay": (1.148, 96, 23, 575, 575, 0, 0, [-0.38609793, 0.0, 0.18671619]),
    "live": (2.00757578, 131, 36, 250, 250, 1, 2, [-0.30344796, -0.303444, 0.42661887]),
    "cell": (2.406881642, 216, 50, 300, 300, 5, 2, [-0.37363347, -0.372252, 0.05482276]),
}


@pytest.mark.parametrize("name", NAMES)
def test_python_reads_all_of_it(name):
    read = steadyhand.read_session(RECORDINGS / f"{name}.mcap")
    counts = [len(part) for part in (read.hand.t, read.steps.t, read.commands.t, read.states.t, read.changes, read.settings)]
    duration, *expected, (command, state, objective) = READ[name]
    assert read.complete and not read.lost and read.duration == pytest.approx(duration, abs=1e-9) and counts == expected
    assert read.commands.q[-1, 0] == pytest.approx(command, abs=1e-8) and read.steps.objective[-1] == pytest.approx(objective, abs=1e-8)
    assert read.states.q[-1, 0] == pytest.approx(state or command, abs=1e-8)
    if name == "live":
        (episode,) = read.episodes
        assert (episode.number, episode.kept, episode.success, episode.task, episode.notes) == (1, True, True, "to the front", "well done")
        assert [(setting.scale, setting.weights["lateral"], setting.weights["position"]) for setting in read.settings] == [
            (0.5, [0.4], [1500.0] * 3), (0.6, [3.0], [1500.0] * 3)]  # fmt: skip
    if name == "cell":
        assert [(change.state, change.reason) for change in read.changes][-1] == ("stopping", "a stop was asked for")
        assert {name for name in read.steps.object_distances} == {"ball", "table"}


@pytest.mark.parametrize(
    ("name", "frames", "task", "action", "state"),
    [("replay", 33, "", 41.661205, 30.088089), ("live", 36, "to the front", 41.478756, 36.9772), ("cell", 70, "", 80.602554, 74.753494)],
    ids=NAMES,
)
def test_it_becomes_a_data_set(name, frames, task, action, state, tmp_path):
    pd = pytest.importorskip("pandas", reason="setup/requirements-dataset.txt is not installed")
    pytest.importorskip("pyarrow", reason="setup/requirements-dataset.txt is not installed")
    said = run(sys.executable, "-m", "steadyhand.dataset", RECORDINGS / f"{name}.mcap", "--out", tmp_path / "set")
    assert f"1 episodes, {frames} frames" in said
    assert json.loads((tmp_path / "set/meta/info.json").read_text())["total_frames"] == frames
    table = pd.concat(map(pd.read_parquet, sorted((tmp_path / "set/data").rglob("*.parquet"))))
    sums = [np.sum(table[column].tolist(), dtype=float) for column in ("action", "observation.state")]
    assert sums == pytest.approx([action, state], rel=1e-5)
    (tasks,) = pd.concat(map(pd.read_parquet, (tmp_path / "set/meta/episodes").rglob("*.parquet")))["tasks"]
    assert list(tasks) == [task]
