"""A task in a scene with contact, from the hand to a data set (docs/reference/tasks.md, docs/how-to/record-data.md)."""

import json
import signal
import subprocess
import time

import numpy as np
import pytest
from live_client import PROGRAM, Client, Demo
from mcap.reader import make_reader

pd = pytest.importorskip("pandas", reason="setup/requirements-dataset.txt is not installed")
pytest.importorskip("pyarrow", reason="setup/requirements-dataset.txt is not installed")
import steadyhand  # noqa: E402
from steadyhand.dataset import __main__ as command  # noqa: E402

PATIENCE = 60.0  # s, for what a busy machine does late


def has_mujoco():
    done = subprocess.run([PROGRAM, "demo", "--arm", "mujoco", "--headless", "--no-recording", "--seconds", "0.2"], capture_output=True, text=True, timeout=120)
    return "MuJoCo" not in done.stderr


pytestmark = pytest.mark.skipif(not has_mujoco(), reason="MuJoCo is not installed")


def refusal(*words):
    done = subprocess.run([PROGRAM, "demo", "--no-browser", "--port", "0", *map(str, words)], capture_output=True, text=True, timeout=120)
    assert done.returncode == 2, done.stdout + done.stderr
    return done.stderr


class Operator:
    """Leads the glass by its hand, from where the target is."""

    def __init__(self, client: Client):
        self.client = client
        client.grip()
        self.at = np.zeros(3)

    def lead_to(self, goal, speed=0.15):
        """Until the tool stands there; m, base frame."""
        deadline = time.monotonic() + PATIENCE
        while True:
            assert time.monotonic() < deadline, (self.client.state["state"], self.client.state["reason"], self.client.state["tools"][0]["pose"], goal)
            if self.client.state["state"] != "engaged":  # a busy machine may keep this client silent for too long
                self.client.grip(take=False)
                self.at = np.zeros(3)
            way = np.array(goal) - np.array(self.client.state["tools"][0]["target"]["p"])
            step = min(0.1, 0.02 * speed / max(np.linalg.norm(way), 1e-9))
            if np.linalg.norm(way) < 0.001 and np.linalg.norm(np.array(goal) - self.client.state["tools"][0]["pose"]["p"]) < 0.005:
                return
            self.at = self.at + step * way
            self.client.sample(self.at, clutch=True)
            self.client.messages(0.02)

    def let_go(self):
        for _ in range(5):
            self.client.sample(self.at, clutch=False)
            self.client.messages(0.02)


def where_the_mark_is(demo):
    """As the page draws it, m."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        watcher = demo.client(pair=False)
        objects = {each["name"]: each for each in watcher.wait_for("welcome")["cell"]["objects"]}
        watcher.socket.close()
        if "mark" in objects:
            return np.array(objects["mark"]["origin"])[:3, 3]
        time.sleep(0.1)
    raise AssertionError("the mark is not drawn")


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """An episode that succeeds and is kept, one that is discarded, and one in which the program is killed. Of a glass that a machine that stands
    still for a moment, and so makes the arm brake, does not spill: what a full one does has tests in virtual time."""
    folder = tmp_path_factory.mktemp("carried")
    demo = Demo(folder, "--arm", "mujoco", "--task", "carry", "--camera", "none", "--scale", 1, "--yaw", 0, "--set", "mujoco.seed=3", "--set", "glass.fill=0.06")
    try:
        client = demo.client()
        mark = where_the_mark_is(demo)
        operator = Operator(client)
        client.send(type="request", kind="episode", text="begin")
        operator.lead_to([mark[0], mark[1], 0.2])
        operator.lead_to([mark[0], mark[1], 0.1225])  # 2.5 mm into the table, which holds it up
        operator.let_go()
        deadline = time.monotonic() + PATIENCE
        while client.state["task"]["success"] is None:
            assert time.monotonic() < deadline, client.state["task"]
            client.messages(0.05)
            client.stay()
        decided = client.state["task"]
        client.send(type="request", kind="episode", text="keep", notes="gently")
        client.send(type="request", kind="set_up", value=7)
        client.send(type="request", kind="episode", text="begin", task="nothing much")
        operator.client.grip(take=False)
        operator.at = np.zeros(3)
        client.send(type="request", kind="set_up")
        assert "episode 2 is running" in client.wait_for("error")["message"]
        operator.lead_to([0.5, 0.0, 0.3])
        client.send(type="request", kind="episode", text="discard")
        client.send(type="request", kind="episode", text="begin")
        operator.lead_to([0.5, 0.1, 0.3])
        counts = client.state["episode"]
    finally:
        demo.process.send_signal(signal.SIGKILL)
        demo.process.wait(PATIENCE)
    return next(folder.glob("*.mcap")), decided, counts, mark


def test_the_task_sees_that_the_glass_stands_on_its_mark(session):
    path, decided, counts, mark = session
    assert decided["success"] is True and decided["held"] == 0b11111 and decided["spilled"] == 0.0
    assert (counts["number"], counts["running"], counts["kept"], counts["discarded"]) == (3, True, 1, 1)
    scenes = steadyhand.read_session(path).scenes
    assert scenes.reset[0] == 1 and scenes.reset[-1] == 2  # set up with seed 7
    done = np.flatnonzero(scenes.success == 1.0)[0]
    np.testing.assert_allclose(scenes.things["mark"][done, :3, 3], mark, atol=1e-6)
    assert not np.allclose(scenes.things["mark"][-1, :3, 3], mark)


def test_scripted_episodes_become_a_data_set(tmp_path, capsys):
    words = [PROGRAM, "tasks", "carry", "--episodes", "2", "--profiles", "tracking", "--sessions", tmp_path / "scripted"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    recorded = sorted((tmp_path / "scripted").glob("*.mcap"))
    assert len(recorded) == 2 and done.stderr.count("recorded: ") == 2
    sessions = [steadyhand.read_session(path) for path in recorded]
    assert [session.metadata["task"]["seed"] for session in sessions] == ["1", "2"]
    for session in sessions:
        assert session.complete and not session.lost
        [episode] = session.episodes
        assert episode.kept and episode.success and episode.task == "Carry the full glass to the mark and set it down there."
    assert command.run([str(tmp_path / "scripted"), "--out", str(tmp_path / "set"), "--no-video"]) == 0
    said = capsys.readouterr()
    assert "2 episodes" in said.out and said.err == ""
    frames = pd.read_parquet(tmp_path / "set/data/chunk-000/file-000.parquet")
    assert frames["next.success"].sum() == 2 and len(frames) > 2 * 5 * 30
    things = json.loads((tmp_path / "set/meta/info.json").read_text())["features"]["observation.environment_state"]["names"]
    ends = dict(zip(things, frames["observation.environment_state"].iloc[-1]))
    assert abs(ends["glass_bottom.x"] - ends["mark.x"]) < 0.03


@pytest.mark.parametrize("words", [["--port", "0"], ["--lan"], ["--task", "peg"], ["--profile", "carry"], ["--scale", "2"]])
def test_options_that_a_script_decides_are_refused(words):
    done = subprocess.run([PROGRAM, "tasks", "carry", "--episodes", "1", *words], capture_output=True, text=True, timeout=60)
    assert done.returncode == 2 and words[0] in done.stderr


def test_what_was_kept_becomes_a_data_set(session, tmp_path, capsys):
    path = session[0]
    read = steadyhand.read_session(path)
    assert not read.complete
    assert [(each.kept, each.success, each.task, each.notes) for each in read.episodes] == [
        (True, True, "Carry the full glass to the mark and set it down there.", "gently"),
        (False, None, "nothing much", ""),
        (False, None, "Carry the full glass to the mark and set it down there.", ""),
    ]
    assert command.run([str(path), "--out", str(tmp_path / "set"), "--task", "unused"]) == 0
    said = capsys.readouterr()
    assert "1 episodes" in said.out
    assert "episode 2: discarded" in said.err and "episode 3: neither kept nor discarded" in said.err
    frames = pd.read_parquet(tmp_path / "set/data/chunk-000/file-000.parquet")
    success = frames["next.success"].to_numpy()
    assert success[-1] and not success[:-1].any()
    info = json.loads((tmp_path / "set/meta/info.json").read_text())
    assert info["features"]["next.success"] == {"dtype": "bool", "shape": [1], "names": ["success"]}
    things = info["features"]["observation.environment_state"]["names"]
    ends = dict(zip(things, frames["observation.environment_state"].iloc[-1]))
    assert abs(ends["glass_bottom.x"] - ends["mark.x"]) < 0.03 and abs(ends["glass_bottom.z"] - ends["mark.z"]) < 0.01
    assert pd.read_parquet(tmp_path / "set/meta/tasks.parquet").index.tolist() == ["Carry the full glass to the mark and set it down there."]
    episode = pd.read_parquet(tmp_path / "set/meta/episodes/chunk-000/file-000.parquet").iloc[0]
    assert episode["success"] and episode["notes"] == "gently"


def check_scripted(task, profile, episodes):
    """All episodes succeed within the limits."""
    words = [PROGRAM, "tasks", task, "--episodes", str(episodes), "--profiles", profile, "--each"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60 + 240 * episodes)
    assert done.returncode == 0, done.stderr
    row = [each.strip() for each in done.stdout.strip().splitlines()[-1].split("|")]
    assert row[1:3] == [f"`{task}`", profile] and row[3].startswith(f"{episodes} of {episodes},"), done.stdout + done.stderr
    assert row[6:9] == ["0.0 %", "0", "0"]  # spilled, beyond limits, contacts with what must not be touched


SCRIPTED = [("stack", "tracking"), ("handover", "tracking"), ("tray", "tray"), ("held_box", "tracking")]


@pytest.mark.parametrize("task, profile", SCRIPTED)
def test_a_scripted_operator_does_the_task(task, profile):
    check_scripted(task, profile, 1)


@pytest.mark.long
@pytest.mark.parametrize("task, profile", SCRIPTED[1:])
def test_two_hands_do_the_task_a_hundred_times(task, profile):
    check_scripted(task, profile, 100)


def test_bad_tasks_are_refused_before_anything_runs(tmp_path):
    assert "task is 'carry', and the arm 'sim' has no contact; --arm mujoco has" in refusal("--task", "carry")
    assert "carry" in refusal("--arm", "mujoco", "--task", "carri")
    (tmp_path / "bad.yaml").write_text("instruction: x\nscene: none.xml\nsuccess:\n  - {upright: tool, within: 0.1}\n")
    assert "none.xml: no such file" in refusal("--arm", "mujoco", "--task", tmp_path / "bad.yaml")
    (tmp_path / "moves.yaml").write_text("instruction: x\nscene: none.xml\nsuccess:\n  - {released: a}\nmoves:\n  - {gripper: 1.5}\n")
    assert "moves.yaml" in (told := refusal("--arm", "mujoco", "--task", tmp_path / "moves.yaml")) and "1.5" in told
    assert "mujoco.contact is 'shove'" in refusal("--arm", "mujoco", "--set", "mujoco.contact=shove")


def test_a_recording_tells_the_arm_that_an_option_chose(tmp_path):
    arguments = ["demo", "--arm", "mujoco", "--headless", "--seconds", "0.5", "--sessions", tmp_path]
    subprocess.run([PROGRAM, *arguments], check=True, capture_output=True, timeout=120)
    with open(next(tmp_path.glob("*.mcap")), "rb") as file:
        told = {metadata.name: metadata.metadata for metadata in make_reader(file).iter_metadata()}
    assert told["settings"]["arm.kind"] == told["run"]["arm"] == "mujoco"
