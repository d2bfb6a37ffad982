"""A policy's turn (docs/how-to/policies.md): beside the program over its protocol, with a person at the desk, and in this process in virtual time."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import steadyhand
from live_client import Demo
from steadyhand import policies
from steadyhand.policies import Action, Simulation

PACKAGE = Path(steadyhand.__file__).parent
PATIENCE = 60.0  # s, for what a busy machine does late
POLICY = '''
import numpy as np
from steadyhand.policies import Action


class Swings:
    """5 cm to and fro about where it first saw the tool."""

    period = 0.05

    def __init__(self, extent="0.05"):
        self.extent, self.middle, self.begin = float(extent), None, 0.0

    def act(self, seen):
        if self.middle is None:
            self.middle, self.begin = seen.T_base_tool, seen.t
        T = self.middle.copy()
        T[1, 3] += self.extent * np.sin(1.5 * (seen.t - self.begin))
        return Action(T)


class Nothing:
    period = 0.05
'''

simulates = pytest.mark.skipif(steadyhand._native.Simulation is None, reason="built without MuJoCo: mujoco-core is not installed")


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "swings.py"
    path.write_text(POLICY)
    return path


def command(*words):
    environment = {**os.environ, "PYTHONPATH": str(PACKAGE.parent), "PYTHONUNBUFFERED": "1"}
    return subprocess.Popen([sys.executable, "-m", "steadyhand", "policy", *map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)


def until(client, what, condition):
    """The first state for which it holds; keeps the lease."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        for message in client.messages(0.05):
            if message["type"] == "state" and condition(message):
                return message
        client.stay()
    raise AssertionError(f"never {what}: {client.state and (client.state['state'], client.state['reason'], client.state['tools'], client.state['controls'])}")


def at_rest(state):
    return max(map(abs, state["dq"])) < 1e-3


def give_turn(client):
    client.send(type="take")
    client.wait_for("lease", yours=True)
    until(client, "connected", lambda s: s["controls"]["policy"] != "" and s["state"] == "ready")
    client.send(type="request", kind="policy", value=1)
    until(client, "led", lambda s: s["tools"][0]["leader"] == "policy" and s["state"] == "engaged")


def test_a_policy_and_a_person_take_turns_and_the_record_says_who_led(tmp_path, file):
    demo = Demo(tmp_path / "sessions", "--profile", "tracking")
    client = demo.client()
    policy = command(f"{file}:Swings", "--port", demo.port)
    give_turn(client)
    end = time.monotonic() + 2.0
    while time.monotonic() < end:
        client.messages(0.05)
        client.stay()
    assert client.state["controls"]["policy"] == "Swings" and client.state["controls"]["policy_turn"]
    client.move(lambda t: (0, 0, 0), 0.1, clutch=False)
    led = []
    client.move(lambda t: (0, 0, 0.05 * t), 2.0, each=lambda s: led.append(s["tools"][0]["leader"]))
    assert led[-1] == "person" and led.count("person") > len(led) // 2
    client.move(lambda t: (0, 0, 0.1), 0.1, clutch=False)
    until(client, "the policy's again", lambda s: s["tools"][0]["leader"] == "policy" and s["state"] == "engaged")
    end = time.monotonic() + 2.0
    while time.monotonic() < end:
        client.messages(0.05)
        client.stay()
    client.send(type="request", kind="stop")
    until(client, "stopped", lambda s: s["state"] == "stopping" and at_rest(s))
    assert not client.state["controls"]["policy_turn"]
    client.send(type="request", kind="policy", value=1)
    assert "stopped" in client.wait_for("error")["message"]
    client.send(type="request", kind="reset")
    until(client, "ready", lambda s: s["state"] == "ready")
    end = time.monotonic() + 1.0
    while time.monotonic() < end:
        client.messages(0.05)
        assert client.state["tools"][0]["leader"] is None, "after a stop it does not go on by itself"
        client.stay()
    policy.send_signal(signal.SIGINT)
    said, _ = policy.communicate(timeout=PATIENCE)
    assert policy.returncode == 0 and "policy leads" in said and "person leads" in said
    demo.end()

    session = steadyhand.read_session(next((tmp_path / "sessions").glob("*.mcap")))
    hand = session.hand
    closed = hand.clutch
    assert set(hand.leader[closed]) == {"person", "policy"}
    assert (hand.intervention[closed] == (hand.leader[closed] == "person")).all(), "each grip of the person was in the policy's turn"
    reasons = [change.reason for change in session.changes]
    assert reasons.count("the arm follows the policy") == 2
    # The second where the policy was late just then, and the arm held.
    assert {"the arm is engaged", "the arm follows the hand"} & set(reasons)
    pytest.importorskip("pandas", reason="setup/requirements-dataset.txt is not installed")
    from steadyhand.dataset import cut

    episodes, left_out = cut(session, steadyhand.Robot("ur5e"), fps=20, episodes="session")
    assert len(episodes) == 1, left_out
    led_by_policy, intervention = (episodes[0].features[name].values[:, 0] for name in ("policy", "intervention"))
    assert not (led_by_policy & intervention).any() and led_by_policy.sum() > 40 and 20 < intervention.sum() < 80
    switches = np.flatnonzero(np.diff(intervention.astype(int)))
    # On a busy machine the person's hand may be held for a moment in between.
    assert len(switches) >= 2 and led_by_policy[switches[0] - 2] and led_by_policy[switches[-1] + 3]


def test_a_policy_that_is_killed_leaves_the_arm_at_rest(tmp_path, file):
    demo = Demo(tmp_path, "--profile", "tracking")
    client = demo.client()
    policy = command(f"{file}:Swings", "--port", demo.port)
    give_turn(client)
    policy.kill()
    policy.wait()
    until(client, "at rest", lambda s: s["state"] == "ready" and at_rest(s) and not s["controls"]["policy_turn"] and s["controls"]["policy"] == "")
    client.send(type="request", kind="policy", value=1)
    assert "no policy is connected" in client.wait_for("error")["message"]
    demo.end()


def test_one_at_a_time_and_who_is_none_says_nothing(tmp_path):
    demo = Demo(tmp_path)
    first, second, stranger = demo.client(), demo.client(), demo.client(pair=False)
    first.send(type="policy", name="first", period_s=0.05)
    until(first, "connected", lambda s: s["controls"]["policy"] == "first")
    second.send(type="policy", name="second", period_s=0.05)
    assert second.wait_for("error")["code"] == "taken"
    second.send(type="target", of_s=second.state["now_s"] if second.state else 0.0, p=[0.5, 0, 0.4], q=[0, 0, 0, 1])
    assert second.wait_for("error")["code"] == "no_lease"
    stranger.send(type="policy", name="stranger", period_s=0.05)
    assert stranger.wait_for("error")["code"] == "unpaired"
    first.send(type="target", of_s=first.state["now_s"] - 1.0, p=[0.5, 0, 0.4], q=[0, 0, 0, 1])
    assert first.wait_for("error")["code"] == "late"
    first.send(type="request", kind="policy", value=1)
    assert first.wait_for("error")["code"] == "no_lease", "connected is not allowed to lead"
    demo.end()


@pytest.mark.long  # the turn ends where the machine holds the policy up
def test_the_command_takes_the_arm_where_it_is_told_to(tmp_path, file):
    demo = Demo(tmp_path, "--profile", "tracking")
    watcher = demo.client(pair=False)
    policy = command(f"{file}:Swings", "0.03", "--port", demo.port, "--turn", "--seconds", 4)
    until(watcher, "led", lambda s: s["tools"][0]["leader"] == "policy")
    said, wrong = policy.communicate(timeout=PATIENCE)
    assert policy.returncode == 0 and not wrong and "policy leads" in said
    until(watcher, "at rest", lambda s: s["state"] == "ready" and at_rest(s))
    demo.end()


@pytest.mark.parametrize(("words", "says"), [
    (["swings.py"], "FILE.py:CLASS"),
    (["nowhere.py:Swings"], "no such file"),
    (["swings.py:Swung"], "has no 'Swung'"),
    (["swings.py:Nothing"], "has no 'act'"),
    (["swings.py:Swings", "--port", "port"], "--port"),
])  # fmt: skip
def test_bad_input_is_told(file, words, says):
    words = [word.replace("swings.py", str(file)) for word in words]
    process = command(*words)
    _, wrong = process.communicate(timeout=PATIENCE)
    assert process.returncode == 2 and says in wrong, wrong


def test_a_program_that_is_not_there_is_told(file):
    process = command(f"{file}:Swings", "--port", 1)
    _, wrong = process.communicate(timeout=PATIENCE)
    assert process.returncode == 1 and "no steadyhand answers on port 1" in wrong


# ---- in this process
@pytest.fixture
def carry():
    simulation = Simulation("carry")
    simulation.begin(1)
    return simulation


class Fixed:
    period = 0.05

    def __init__(self, T):
        self.T = T

    def act(self, seen):
        return Action(self.T)


@simulates
def test_a_policy_that_carries_the_glass_succeeds_and_another_does_not():
    class Carries:
        period = 0.05

        def act(self, seen):
            T, mark, bottom = seen.T_base_tool.copy(), seen.things["mark"], seen.things["glass_bottom"]
            off = mark[:3, 3] - bottom[:3, 3]
            above = off[2] + (0.06 if np.linalg.norm(off[:2]) > 0.005 else -0.004)
            T[:3, 3] += np.clip(np.array([off[0], off[1], above]), -0.006, 0.006)
            T[:3, :3] = seen.T_base_target[:3, :3]
            return Action(T)

    simulation = Simulation("carry", profile="carry")
    for seed in (1, 2):
        seen = simulation.begin(seed)
        assert seen.state == "ready" and seen.leader is None and set(seen.things) == {"mark", "glass", "glass_bottom", "table"}
        outcome = simulation.run(Carries())
        assert outcome.success and outcome.beyond_limits == 0 and outcome.forbidden == 0, outcome
    seen = simulation.begin(1)
    assert simulation.run(Fixed(seen.T_base_tool)).success is False


@simulates
def test_the_operator_takes_over_and_hands_back(carry):
    home = carry.observe().T_base_tool
    carry.connect("fixed", 0.05)
    carry.turn()
    for _ in range(20):
        carry.target(Action(home))
        seen = carry.advance(0.05)
    assert seen.leader == "policy" and seen.state == "engaged"
    carry.operate(in_the_middle=True)
    for _ in range(40):
        carry.target(Action(home))
        seen = carry.advance(0.05)
    assert seen.leader == "person" and carry.policy_turn
    assert np.linalg.norm(seen.T_base_tool[:3, 3] - home[:3, 3]) > 0.01
    carry.let_go()
    for _ in range(20):
        carry.target(Action(home))
        seen = carry.advance(0.05)
    assert seen.leader == "policy"
    carry.stop()
    carry.advance(1.0)
    assert not carry.policy_turn and carry.observe().state == "stopping" and carry.outcome.over


@simulates
def test_what_is_no_number_holds_the_arm(carry):
    home = carry.observe().T_base_tool
    carry.connect("fixed", 0.05)
    carry.turn()
    carry.target(Action(home))
    assert carry.advance(0.2).leader == "policy"
    carry.target(Action(np.full((4, 4), np.nan)))
    seen = carry.advance(0.2)
    assert seen.state == "holding" and seen.reason == "the policy's target is not a number"


@simulates
def test_the_same_seed_is_the_same_run():
    ends = []
    for _ in range(2):
        simulation = Simulation("carry")
        simulation.begin(3)
        simulation.operate()
        seen = simulation.advance(4.0)
        ends.append(seen.q)
    assert (ends[0] == ends[1]).all()


@simulates
def test_a_simulation_refuses_what_is_none(carry):
    with pytest.raises(steadyhand.SteadyhandError, match="juggle"):
        Simulation("juggle")
    with pytest.raises(ValueError, match="begin"):
        Simulation("carry").observe()
    with pytest.raises(steadyhand.SteadyhandError, match="no policy is connected"):
        carry.turn()
    with pytest.raises(steadyhand.SteadyhandError, match="period"):
        carry.connect("slow", 2.0)
    with pytest.raises(ValueError, match="shape"):
        carry.target(Action(np.eye(3)))


def test_the_package_says_what_it_has():
    for name in policies.__all__:
        assert getattr(policies, name).__doc__
