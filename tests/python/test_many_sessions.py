"""Many sessions: a job for each, in processes and on a Ray cluster (docs/how-to/record-data.md, "Many sessions")."""

import csv
import json
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from sample import PROGRAM

pd = pytest.importorskip("pandas", reason="setup/requirements-dataset.txt is not installed")
pytest.importorskip("pyarrow", reason="setup/requirements-dataset.txt is not installed")
import steadyhand  # noqa: E402
from steadyhand import _jobs  # noqa: E402
from steadyhand.score import __main__ as command  # noqa: E402
from steadyhand.score import score  # noqa: E402

PATIENCE = 120.0  # s, for what a busy machine does late


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A brisk hand, followed as closely as the arm can."""
    folder = tmp_path_factory.mktemp("recorded")
    t = np.arange(0.0, 4.0, 1 / 90)
    rows = [f"{at:.5f},{0.3 * np.sin(5 * at):.6f},{0.2 * np.sin(6 * at):.6f},1.2,0,0,0,1" for at in t]
    (folder / "hand.csv").write_text("t,px,py,pz,qx,qy,qz,qw\n" + "\n".join(rows) + "\n")
    subprocess.run([PROGRAM, "replay", folder / "hand.csv", "--profile", "tracking", "--rate", "50", "--out", folder / "out"], check=True, capture_output=True, timeout=600)
    return folder / "out/tracking/session.mcap"


def copies(recorded, folder, *names):
    folder.mkdir()
    for name in names:
        (folder / f"{name}.mcap").write_bytes(recorded.read_bytes())
    return folder


def run(*words):
    return command.main([str(word) for word in words])


def test_what_was_driven_is_scored_by_its_own_numbers(recorded):
    session = steadyhand.read_session(recorded)
    row = score(session, steadyhand.Robot("ur5e"))
    apart = np.linalg.norm(session.steps.T_base_target[:, :3, 3] - session.steps.T_base_tool[:, :3, 3], axis=1)[session.steps.engaged]
    assert row.position_rms_mm == pytest.approx(1e3 * math.sqrt(np.mean(apart**2)))
    assert row.plans == len(session.steps.t) and row.refused == 0 and row.profile == "as recorded"
    assert 0.0 < row.speed_percent <= 100.1 and row.spilled_percent > 1.0 and row.clearance_mm > 0.0
    assert row.bend_max > 1.0 and 3.5 < row.followed_s <= row.seconds < 4.5
    with pytest.raises(ValueError, match="the robot gen3 has"):
        score(session, steadyhand.Robot("gen3"))


def test_old_hands_are_planned_anew_and_kept(recorded, tmp_path, capsys):
    folder = copies(recorded, tmp_path / "old", "a", "b")
    (folder / "broken.mcap").write_bytes(recorded.read_bytes()[:100])
    (folder / "empty.mcap").write_bytes(b"")
    assert run(folder, "--profile", "carry", "tracking", "--out", tmp_path / "rows.csv", "--keep", tmp_path / "kept", "--workers", 2) == 0
    said = capsys.readouterr()
    assert "broken.mcap" in said.err and "empty.mcap" in said.err and said.err.count("left out") == 2
    rows = list(csv.DictReader((tmp_path / "rows.csv").open()))
    assert [(row["session"], row["profile"]) for row in rows] == [("a", "carry"), ("a", "tracking"), ("b", "carry"), ("b", "tracking")]
    assert float(rows[0]["spilled_percent"]) == 0.0 < float(rows[1]["spilled_percent"])
    assert rows[1]["position_rms_mm"] == rows[3]["position_rms_mm"], "the same hand, the same plans"
    assert "| mean of 2 | carry |" in said.out
    assert sorted(path.name for path in (tmp_path / "kept").iterdir()) == ["a-carry.mcap", "a-tracking.mcap", "b-carry.mcap", "b-tracking.mcap"]
    from steadyhand.dataset import __main__ as dataset

    assert dataset.main([str(tmp_path / "kept/a-carry.mcap"), "--out", str(tmp_path / "set")]) == 0


@pytest.mark.parametrize("words, reason", [
    (["nowhere.mcap"], "nowhere.mcap: there is no such file"),
    (["EMPTY"], "has no session"),
    (["SESSION", "--profile", "hasty"], "hasty"),
    (["SESSION", "--profile", "carry", "carry"], "'carry' is named twice"),
    (["SESSION", "--rate", "50"], "--rate: --profile is missing; it selects the profiles of new plans"),
    (["SESSION", "--keep", "kept"], "--keep: --profile is missing"),
    (["SESSION", "--profile", "carry", "--rate", "nan"], "--rate is nan"),
    (["SESSION", "--profile", "carry", "--rate", "1e9"], "--rate is 1e+09"),
    (["SESSION", "--workers", "65"], "--workers is 65"),
    (["SESSION", "--workers", "2", "--ray", "auto"], "--workers and --ray were both given"),
    (["SESSION", "--ray", ""], "--ray is empty"),
    (["SESSION", "--robot", "gen3"], "the robot gen3 has"),
    (["HAND"], "hand.csv"),
])  # fmt: skip
def test_bad_input(recorded, tmp_path, monkeypatch, capsys, words, reason):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    names = {"SESSION": str(recorded), "HAND": str(recorded.parents[2] / "hand.csv"), "EMPTY": "empty"}
    assert run(*(names.get(word, word) for word in words)) == 2
    said = capsys.readouterr()
    assert reason in said.err and not said.out
    assert [path.name for path in tmp_path.iterdir()] == ["empty"]


def test_of_a_folder_what_led_to_a_fault_is_left_out_where_its_session_is_there(tmp_path):
    from steadyhand._jobs import sessions_of

    for name in ("one", "one-fault-1", "two-fault-12"):
        (tmp_path / f"{name}.mcap").touch()
    assert [path.stem for path in sessions_of([str(tmp_path)])] == ["one", "two-fault-12"]
    assert [path.stem for path in sessions_of([str(tmp_path / "one-fault-1.mcap")])] == ["one-fault-1"]


def test_a_full_disk_leaves_the_rows_that_were_there(recorded, tmp_path, monkeypatch, capsys):
    (tmp_path / "rows.csv").write_text("mine")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    assert run(recorded, "--out", tmp_path / "rows.csv") == 2 and "No space left" in capsys.readouterr().err
    assert (tmp_path / "rows.csv").read_text() == "mine" and len(list(tmp_path.iterdir())) == 1


# On a cluster of two nodes, each with one worker, on this machine.

def slow(path):
    """A job that says where it runs, and takes its time; of this name, one that kills whoever does it."""
    (path.parent / f"{path.stem}.at.{os.getpid()}").touch()
    if path.stem == "deadly":
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(2.0)
    return path.stem


class Cluster:
    """As somebody starts it on two machines."""

    def __init__(self, folder):
        self.environment = os.environ | {"RAY_USAGE_STATS_ENABLED": "0", "PYTHONPATH": ""}
        self.nodes, self.address = [], ""
        for number, words in enumerate((["--head", "--port=0", "--include-dashboard=false", f"--temp-dir={folder}"], None)):
            words = words or [f"--address={self.address}"]
            log = (folder / f"node-{number}.log").open("w+")
            command = [sys.executable, "-m", "ray.scripts.scripts", "start", *words, "--num-cpus=1", "--block", "--disable-usage-stats", "--object-store-memory=200000000"]
            self.nodes.append(subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT, env=self.environment, start_new_session=True))
            self.address = self.address or self._address(folder)

    @staticmethod
    def _address(folder):
        deadline = time.monotonic() + PATIENCE
        while not (found := list(folder.glob("session_latest/../ray_current_cluster")) + list(folder.glob("ray_current_cluster"))):
            assert time.monotonic() < deadline, (folder / "node-0.log").read_text()
            time.sleep(0.2)
        return found[0].read_text().strip()

    def kill(self, number):
        """As when a machine goes."""
        os.killpg(self.nodes[number].pid, signal.SIGKILL)
        self.nodes[number].wait()

    def end(self):
        for node in self.nodes:
            if node.poll() is None:
                os.killpg(node.pid, signal.SIGTERM)
        for node in self.nodes:
            try:
                node.wait(20.0)
            except subprocess.TimeoutExpired:
                os.killpg(node.pid, signal.SIGKILL)


@pytest.fixture
def cluster():
    import tempfile

    pytest.importorskip("ray", reason="setup/requirements-ray.txt is not installed")
    with tempfile.TemporaryDirectory(prefix="ray-") as folder:  # a short path: those of its sockets are limited
        found = Cluster(Path(folder))
        try:
            yield found
        finally:
            found.end()


@pytest.mark.long
def test_a_cluster_makes_the_same_data_set_and_names_what_is_broken(recorded, tmp_path, cluster, capsys):
    from steadyhand.dataset import __main__ as dataset

    folder = copies(recorded, tmp_path / "old", "a", "b", "c")
    (folder / "broken.mcap").write_bytes(recorded.read_bytes()[:100])
    for name, words in (("here", []), ("there", ["--ray", cluster.address])):
        assert dataset.main([str(folder), "--out", str(tmp_path / name), *words]) == 0
        said = capsys.readouterr()
        assert "3 episodes" in said.out and said.err.count("left out") == 1 and "broken.mcap" in said.err
    for path in sorted((tmp_path / "here").rglob("*.parquet")):
        assert pd.read_parquet(path).equals(pd.read_parquet(tmp_path / "there" / path.relative_to(tmp_path / "here")))
    assert run(folder, "--profile", "carry", "--out", tmp_path / "here.csv") == run(folder, "--profile", "carry", "--out", tmp_path / "there.csv", "--ray", cluster.address) == 0
    here, there = (list(csv.DictReader((tmp_path / f"{name}.csv").open())) for name in ("here", "there"))
    assert len(here) == 3 and [row | {"solve_us": ""} for row in here] == [row | {"solve_us": ""} for row in there]


@pytest.mark.long
def test_a_worker_that_is_killed_loses_nothing(tmp_path, cluster):
    names = [*"abcdefgh", "deadly"]
    for name in names:
        (tmp_path / f"{name}.mcap").touch()
    files = [tmp_path / f"{name}.mcap" for name in names]
    script = f"""
import json, sys
sys.path[:0] = {[str(Path(__file__).parent), *sys.path]!r}
from pathlib import Path
import test_many_sessions as here
answers = here._jobs.do_each(here.slow, [Path(name) for name in json.loads(sys.argv[1])], here._jobs.Workers(ray=sys.argv[2]))
print(json.dumps(sorted(answers.values())))
"""
    process = subprocess.Popen([sys.executable, "-c", script, json.dumps([str(path) for path in files]), cluster.address], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + PATIENCE
    while not (begun := [path for path in tmp_path.glob("*.at.*") if not path.name.startswith("deadly")]):
        assert time.monotonic() < deadline and process.poll() is None, process.communicate()
        time.sleep(0.05)
    os.kill(int(begun[0].suffix[1:]), signal.SIGKILL)  # one worker
    while len([path for path in tmp_path.glob("*.at.*")]) < 4:
        assert time.monotonic() < deadline, list(tmp_path.iterdir())
        time.sleep(0.05)
    cluster.kill(1)  # and one machine
    out, err = process.communicate(timeout=2 * PATIENCE)
    assert process.returncode == 0, err
    assert json.loads(out.splitlines()[-1]) == list("abcdefgh"), err
    assert len(list(tmp_path.glob(f"{begun[0].name.split('.')[0]}.at.*"))) > 1, "it was done again"
    assert 1 < len(list(tmp_path.glob("deadly.at.*"))) < 10, "and the one that kills was given up"


@pytest.mark.long
@pytest.mark.parametrize("address", ["127.0.0.1:1", "127.0.0.1:99999", "nowhere.invalid:6379", "auto", "half a word"])
def test_no_cluster_is_told(recorded, capsys, address):
    pytest.importorskip("ray", reason="setup/requirements-ray.txt is not installed")
    assert run(recorded, "--ray", address) == 2
    assert f"--ray is '{address}'; no Ray cluster answers there" in capsys.readouterr().err
