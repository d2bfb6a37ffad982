"""`./steadyhand demo --dataset DIR`: a session whose kept episodes are a data set as soon as it ends (docs/how-to/record-data.md)."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from live_client import PROGRAM, Demo

pd = pytest.importorskip("pandas", reason="setup/requirements-dataset.txt is not installed")
pytest.importorskip("pyarrow", reason="setup/requirements-dataset.txt is not installed")
import steadyhand  # noqa: E402
from steadyhand.dataset import __main__ as command  # noqa: E402

COMMAND = (sys.executable, "-m", "steadyhand", "demo")
ENVIRONMENT = {**os.environ, "STEADYHAND_PROGRAM": PROGRAM, "PYTHONPATH": str(Path(PROGRAM).parent / "python")}


def hand(t):
    return (0.05 * (1.0 - 2.0 ** (-t)), 0.0, 0.0)


def lead(folder, data, *verdicts):
    """A session in which so many episodes are led, and end so; what was said."""
    demo = Demo(folder, "--dataset", data, command=COMMAND, environment=ENVIRONMENT)
    client = demo.client()
    client.grip()
    for verdict in verdicts:
        client.send(type="request", kind="episode", text="begin", task="to the front")
        begin = time.monotonic()
        while time.monotonic() < begin + 2.5:
            client.move(hand, 0.5)
        client.send(type="request", kind="episode", text=verdict)
        client.messages(0.2)
    client.send(type="ping", t_s=0.0)
    client.wait_for("pong")
    return demo.end()


def test_what_is_kept_is_in_the_data_set_when_the_session_ends(tmp_path):
    data = tmp_path / "set"
    said = lead(tmp_path / "first", data, "keep", "discard")
    assert f"{data}: 1 episodes" in said, said
    said = lead(tmp_path / "second", data, "keep")
    assert "2 and" in said, said
    info = json.loads((data / "meta/info.json").read_text())
    assert info["total_episodes"] == 2 and info["fps"] == 30
    episodes = pd.concat(pd.read_parquet(path) for path in sorted((data / "meta/episodes").rglob("*.parquet")))
    assert [list(tasks) for tasks in episodes["tasks"]] == [["to the front"]] * 2
    assert episodes["session"].nunique() == 2
    said = lead(tmp_path / "third", data)
    assert "no episode was kept and whole, it stays as it was\n" in said and json.loads((data / "meta/info.json").read_text()) == info


@pytest.mark.long
def test_it_goes_on_as_the_data_set_was_made(tmp_path):
    data = tmp_path / "set"
    lead(tmp_path / "first", tmp_path / "other", "keep")
    (session,) = (tmp_path / "first").glob("*.mcap")
    assert command.run([str(session), "--out", str(data), "--fps", "10", "--action", "pose"]) == 0
    assert "2 and" in lead(tmp_path / "second", data, "keep")
    info = json.loads((data / "meta/info.json").read_text())
    assert info["fps"] == 10 and info["total_episodes"] == 2 and info["features"]["action"]["names"][0] == "tool.x"


def test_what_cannot_be_is_told_before_anybody_leads(tmp_path):
    def refusal(*words):
        done = subprocess.run([*COMMAND, "--no-browser", "--port", "0", *map(str, words)], capture_output=True, text=True, timeout=60, env=ENVIRONMENT, stdin=subprocess.DEVNULL)
        assert done.returncode == 2 and not done.stdout, done.stdout + done.stderr
        return done.stderr

    (tmp_path / "papers").mkdir()
    (tmp_path / "papers/note").write_text("mine")
    assert "has no meta/info.json" in refusal("--dataset", tmp_path / "papers")
    assert "no_recording" in refusal("--dataset", tmp_path / "set", "--no-recording").replace("-", "_")
    assert "needs one folder" in refusal("--dataset")
    assert "no-such-robot" in refusal("--dataset", tmp_path / "set", "--robot", "no-such-robot")
    assert not (tmp_path / "set").exists()
