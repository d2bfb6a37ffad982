"""A study led live: the program, its leader at the terminal, and a participant who answers and leads the arm through the protocol."""

import csv
import os
import re
import select
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import steadyhand
from steadyhand._page_client import Lost, PageClient

STUDY = """
name: live
participants: 1
conditions:
  - {name: only, profile: follow, latency: 0.1}
tasks:
  - {kind: carry, places: [[0, 0.06, 0]], radius: 0.03, holding: 0.2, timeout: 60}
repetitions: 1
training: 0
questionnaires: [nasa-tlx]
"""

TWO_HANDS = STUDY.replace("participants: 1", "participants: 1\nrobot: two_ur5e").replace(
    "kind: carry, places: [[0, 0.06, 0]], radius: 0.03, holding: 0.2", "kind: targets, tools: [left, right], distance: 0.08, width: 0.06, count: 3")


class Participant(threading.Thread):
    """Agrees, answers 10 to everything, and moves the glasses to where the page shows goals, with a hand for each."""

    def __init__(self, port):
        super().__init__(daemon=True)
        self.client, self.asked, self.tasks, self.latencies = PageClient(port), [], [], set()

    def run(self):
        try:
            self._take_part()
        except Lost:
            pass  # the study is over

    def _take_part(self):
        hands, content, state, sequence, last = np.zeros((2, 3)), None, None, 0, time.monotonic()
        self.client.send(type="take")
        while True:
            for message in self.client.messages(0.011):
                if message["type"] == "state":
                    state = message
                elif message["type"] == "study":
                    content = message["content"]
                    if content and content["kind"] == "question":
                        self.asked.append(content["key"])
                        self.client.send(type="reply", content={"key": content["key"], "value": 99})  # refused
                        self.client.send(type="reply", content={"key": content["key"], "value": min(10, content["high"])})
            now = time.monotonic()
            dt, last = min(now - last, 0.05), now
            leads = content is not None and content["kind"] == "task" and content["goal"] is not None
            if leads and state is not None:
                self.tasks.append(content["of"])
                self.latencies.add(state["controls"]["latency"])
                for k, (tool, goal) in enumerate(zip(state["tools"], [content["goal"], *content["other_goals"]])):
                    # The operator's axes, turned by yaw, -90 degrees, are the base's.
                    away = np.array(goal["p"]) - tool["target"]["p"]
                    hands[k] += np.array([-away[1], away[0], away[2]]) * min(1.0, dt / 0.5) * (np.linalg.norm(away) > 0.004)
            for k in range(len(state["tools"]) if state is not None else 1):
                # A grip that was not heard is tried again, as people do.
                grips = leads and state is not None and (state["tools"][k]["engaged"] or now % 1.5 > 0.4)
                sequence += 1
                self.client.send(type="sample", sequence=sequence, t_s=now, p=[*map(float, hands[k])], q=[0, 0, 0, 1], clutch=bool(grips), tracked=True,
                                 emulated=False, **({"tool": k} if k else {}))  # fmt: skip


def begin(study, out):
    """A leader under way: its process, what it said, and its port."""
    environment = {**os.environ, "PYTHONPATH": str(Path(steadyhand.__file__).parents[1]), "PYTHONUNBUFFERED": "1",
                   "STEADYHAND_PROGRAM": os.environ.get("STEADYHAND_PROGRAM", "build/release/steadyhand")}
    environment.pop("DISPLAY", None)
    leader = subprocess.Popen([sys.executable, "-m", "steadyhand.study", str(study), "--out", str(out), "--port", "0"], env=environment,
                              stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    said = []
    for line in leader.stdout:
        said.append(line)
        if found := re.search(r"page: http://[^:]+:(\d+)/", line):
            break
    else:
        raise AssertionError("".join(said))
    return leader, environment, said, int(found.group(1))


def answers(port: int) -> bool:
    with socket.socket() as asking:
        return asking.connect_ex(("127.0.0.1", port)) == 0


def test_a_second_page_that_takes_the_arm_is_told(tmp_path):
    """A browser tab more, which the first one lets have it."""
    study = tmp_path / "live.yaml"
    study.write_text(STUDY)
    leader, _, said, port = begin(study, tmp_path / "out")
    try:
        first, second = PageClient(port), PageClient(port)
        heard, holds, again, end = "", False, 0.0, time.monotonic() + 60
        while "another page" not in heard and time.monotonic() < end:
            if time.monotonic() > again:  # a busy machine may cost the first one its lease
                again = time.monotonic() + 1.0
                second.send(type="ask") if holds else first.send(type="take")
            for message in first.messages(0.02):
                if message["type"] == "lease":
                    holds = message["yours"]
                    if message["asker"]:
                        first.send(type="answer", grant=True)
            for _ in second.messages(0.02):
                pass
            if select.select([leader.stdout], [], [], 0.0)[0]:
                heard += os.read(leader.stdout.fileno(), 65536).decode()
    finally:
        leader.kill()
    ended = time.monotonic() + 20
    while answers(port) and time.monotonic() < ended:
        time.sleep(0.1)
    assert not answers(port), "the program ends with who led the study"
    assert "another page (client" in heard and "close the page that is not the participant's" in heard, heard


@pytest.mark.parametrize("text", [STUDY, TWO_HANDS], ids=["one hand", "two hands"])
def test_a_participant_is_led_through_a_study(tmp_path, text):
    study = tmp_path / "live.yaml"
    study.write_text(text)
    out = tmp_path / "out"
    leader, environment, said, port = begin(study, out)
    participant = Participant(port)
    participant.start()
    leader.stdin.write("\n")
    leader.stdin.flush()
    try:
        rest, _ = leader.communicate(timeout=150)
    finally:
        leader.kill()
    text = "".join(said) + rest
    assert leader.returncode == 0 and "P01 is done" in text, text
    assert participant.asked[0] == "consent" and len(participant.asked) == 7, "consent and the six scales"
    assert "answered tlx_mental with 99" in text
    assert participant.latencies == {0.1}
    [trial] = out.glob("participants/P01/trials/*.csv")
    rows = {row["measure"]: float(row["value"]) for row in csv.DictReader(trial.open()) if row["goal"] == "-1"}
    assert ("throughput_second" in rows) == ("tools" in study.read_text())
    assert rows["missed"] == 0 and 0.1 < rows["completion_time"] < 60 and 0.03 < rows["path_length"] < 1.0, (rows, text)
    answers = list(csv.DictReader((out / "participants/P01/answers.csv").open()))
    assert [row["value"] for row in answers] == ["10"] * 6
    [session] = out.glob("participants/P01/sessions/*.mcap")
    assert len(steadyhand.read_session(session).commands.t) > 500
    # A participant who is done does not control the arm again.
    again = subprocess.run(leader.args, env=environment, capture_output=True, text=True, timeout=60)
    assert again.returncode == 0 and "all participants are done" in again.stdout
