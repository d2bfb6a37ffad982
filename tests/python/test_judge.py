"""The adversary's judge (tests/soak/judge.py) against recordings that are right, and against the same ones doctored: each rule
finds what it is for."""

import copy
import json
import sys

import numpy as np
import pytest
from mcap.writer import Writer

from places import ROOT

sys.path.insert(0, str(ROOT / "tests/soak"))
from judge import judge  # noqa: E402
from motion_rules import command_steps  # noqa: E402
from recorded_session import RecordedSession  # noqa: E402
from session_log import SessionLog  # noqa: E402

CYCLE = 0.002
BEGIN = 1000.0  # s, on the machine's clock
ROBOT = {
    "name": "two joints", "joints": [{"name": "a", "type": "revolute", "origin": np.eye(4).tolist(), "axis": [0, 0, 1]},
                                     {"name": "b", "type": "prismatic", "origin": np.eye(4).tolist(), "axis": [1, 0, 0]}],
    "position_min": [-1.0, -1.0], "position_max": [1.0, 1.0], "velocity_max": [2.0, 2.0], "acceleration_max": [10.0, 10.0],
    "bodies": [{"name": "base", "link": 0, "shape": "sphere", "radius": 0.1, "origin": [[1, 0, 0, -0.6], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]},
               {"name": "hand", "link": 2, "shape": "sphere", "radius": 0.1, "origin": np.eye(4).tolist()}],
    "pairs": [[0, 1]],
}


class Sheet:
    """A session as it should be: the hand closes at 1 s and leads until 3 s; a stop at 5 s, a reset at 6 s; a grip at 7 s that
    is stopped at 7.6 s, reset at 9.5 s; told to end at 10 s."""

    def __init__(self):
        self.t = np.arange(0.0, 10.0, CYCLE)
        s = np.clip(self.t - 1.0, 0.0, 2.0) * np.pi
        self.q = np.stack([0.1 * (1 - np.cos(s)), 0.05 * (1 - np.cos(s))], axis=1)
        self.dq = np.stack([0.1 * np.pi * np.sin(s), 0.05 * np.pi * np.sin(s)], axis=1)
        self.ddq = np.stack([0.1 * np.pi**2 * np.cos(s), 0.05 * np.pi**2 * np.cos(s)], axis=1)
        self.dq[(self.t < 1.0) | (self.t > 3.0)] = self.ddq[(self.t < 1.0) | (self.t > 3.0)] = 0.0
        self.state_q, self.state_dq = self.q.copy(), self.dq.copy()
        self.kept = np.ones(len(self.t), dtype=bool)
        self.changes = [(0.05, "idle", "ready"), (1.004, "ready", "engaged"), (3.004, "engaged", "ready"), (5.004, "ready", "stopping"),
                        (6.004, "stopping", "idle"), (6.054, "idle", "ready"), (7.004, "ready", "engaged"), (7.604, "engaged", "stopping"),
                        (9.504, "stopping", "idle"), (9.554, "idle", "ready"), (9.9, "ready", "stopping")]
        self.profiles = [(0.0, "gentle"), (0.5, "tracking"), (6.0, "gentle")]
        self.log = [dict(t=0.0, kind="start", velocity_scales={"gentle": 0.1}), dict(t=0.3, kind="take", client="o", paired=True), dict(t=0.31, kind="lease", client="o", holder=1)]
        for t in np.arange(0.5, 7.6, 0.01):
            self.log.append(dict(t=t, kind="sample", client="o", clutch=bool(1.0 <= t < 3.0 or t >= 7.0)))
        for t, kind in ((5.0, "stop"), (6.0, "reset"), (7.6, "stop"), (9.5, "reset")):
            self.log.append(dict(t=t, kind="request", client="o", request=kind, text=None))
        self.log.append(dict(t=9.99, kind="end", how="told", code=0, took=0.5, said="5000 looked at, 0 beyond a limit, 0 in contact"))
        self.log.append(dict(t=4.0, kind="spied", path="/sessions", shows="Accept: */*", status=401, size=300))
        self.log.append(dict(t=10.5, kind="archive", before={"a": "label of a", "b": ""}, after=[["b", ""], ["a", "label of a"]], killed=False, recordings=1))

    def request(self, t, kind, client="o", text=None):
        self.log.append(dict(t=t, kind="request", client=client, request=kind, text=text))

    def drop(self, *kinds, begin=-1.0, end=99.0, **members):
        self.log = [e for e in self.log if not (e["kind"] in kinds and begin <= e["t"] <= end and all(e[k] == v for k, v in members.items()))]

    def add(self, what, cycles, joint, by):
        getattr(self, what)[cycles, joint] += by

    def lose(self, begin, end):
        self.kept[(self.t > begin) & (self.t < end)] = False

    def stops_at(self, t):
        self.changes[3] = (t, "ready", "stopping")

    def push(self, begin, end, joint, step):
        """Another motion of a joint on top: a smooth hill."""
        hill = (self.t >= begin) & (self.t <= end)
        x = (self.t[hill] - begin) / (end - begin) * 2 * np.pi
        w = 2 * np.pi / (end - begin)
        for q, dq in ((self.q, self.dq), (self.state_q, self.state_dq)):
            q[hill, joint] += step * (1 - np.cos(x)) / 2
            dq[hill, joint] += step * w * np.sin(x) / 2
        self.ddq[hill, joint] += step * w * w * np.cos(x) / 2

    def messages(self):
        kept = np.flatnonzero(self.kept)
        lists = [a[kept].tolist() for a in (self.t, self.q, self.dq, self.ddq, self.state_q, self.state_dq)]
        return {"/joint_command": [(t, dict(q=q, dq=dq, ddq=ddq)) for t, q, dq, ddq, _, _ in zip(*lists)],
                "/joint_state": [(t, dict(q=q, dq=dq)) for t, _, _, _, q, dq in zip(*lists)],
                "/supervision": [(t, {"from": before, "to": after, "reason": after}) for t, before, after in self.changes],
                "/operator_settings": [(t, {"profile": name}) for t, name in self.profiles]}

    def recorded(self):
        return RecordedSession(self.messages(), {"robot": {"json": json.dumps(ROBOT)}}, [(self.t[0], self.t[-1])])

    def rules(self, unrecorded=0):
        """Those that are broken."""
        looks = [dict(t=self.t[i], kind="look", now_s=BEGIN + self.t[i], q=self.state_q[i].tolist(), dq=self.state_dq[i].tolist(),
                      cycles=int(self.kept[:i + 1].sum()) + unrecorded) for i in range(400, 4000, 50) if self.kept[i]]
        log = [dict(e, t=e["t"] + BEGIN, **({"until": e["until"] + BEGIN} if "until" in e else {})) for e in copy.deepcopy(self.log) + looks]
        log = SessionLog(log)
        found = judge(self.recorded(), log)
        assert log.begin == pytest.approx(BEGIN, abs=0.002)
        return {rule for rule, _, _ in found}


@pytest.fixture()
def sheet():
    return Sheet()


def test_a_session_as_it_should_be_breaks_nothing(sheet):
    assert sheet.rules() == set()


def write(path, messages):
    with open(path, "wb") as file:
        writer = Writer(file, chunk_size=100_000)
        writer.start()
        writer.add_metadata("robot", {"json": json.dumps(ROBOT)})
        for topic, entries in messages.items():
            channel = writer.register_channel(topic, "json", 0)
            for t, members in entries:
                writer.add_message(channel, round(1e9 * t), json.dumps(members).encode(), round(1e9 * t))
        writer.finish()


def test_a_second_file_may_begin_between_a_command_and_its_state(sheet, tmp_path):
    whole = sheet.messages()
    write(tmp_path / "1.mcap", {topic: [m for m in messages if m[0] < 1.6] for topic, messages in whole.items()})
    write(tmp_path / "2.mcap", {topic: [m for m in messages if m[0] > (2.0 if topic == "/joint_command" else 2.003)]
                               for topic, messages in whole.items()})
    read = RecordedSession.read([tmp_path / "1.mcap", tmp_path / "2.mcap"])
    assert [rule for rule, _, _ in command_steps(read)] == []
    read.spans = read.spans[:1]  # the same commands, as if nothing had not been recorded
    assert [rule for rule, _, _ in command_steps(read)] == ["command step"]


def test_a_file_reads_as_what_was_written_also_when_it_is_cut_short(sheet, tmp_path):
    write(tmp_path / "session.mcap", sheet.messages())
    written, read = sheet.recorded(), RecordedSession.read([tmp_path / "session.mcap"])
    assert read.robot == ROBOT and [c[1:] for c in read.changes] == [c[1:] for c in written.changes]
    assert read.spans == [pytest.approx(span) for span in written.spans]
    for track in ("commands", "states"):
        a, b = getattr(written, track), getattr(read, track)
        assert len(a) == len(b) and np.allclose(a.t, b.t, atol=1e-9) and np.array_equal(a.q, b.q) and np.array_equal(a.dq, b.dq)
    content = (tmp_path / "session.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(content[:len(content) // 2])
    cut = RecordedSession.read([tmp_path / "cut.mcap"])
    assert cut.robot == ROBOT and 100 < len(cut.commands) < len(written.commands)


def test_a_recording_that_began_late_is_set_beside_the_log(sheet):
    sheet.state_q += 1e-4 * sheet.t[:, None]  # creeps, so that each look is found again
    sheet.state_dq += 1e-4
    assert sheet.rules(unrecorded=700) == set()


def ends(s, **members):
    s.drop("end")
    s.log.append(dict(t=9.99, kind="end") | dict(how="told", code=0, took=0.5, said=SUMMARY, unread=False, deaf=False) | members)


def archive(s, *after, **members):
    s.drop("archive")
    s.log.append(dict(t=10.5, kind="archive", before={"a": "label of a", "b": ""}, after=list(after)) | dict(killed=False, recordings=1) | members)


def reset_at_6_is(s, t=None, client="o"):
    s.drop("request", request="reset", begin=5.9, end=6.1)
    if t is not None:
        s.request(t, "reset", client)


def measured_bend(s):
    x = np.clip(s.t - 1.5, 0, 0.1)
    s.state_q[:, 1] += 0.009 * (1 - np.cos(2 * np.pi * x / 0.1)) / 2


def a_stranger_moves_it(s):
    s.push(4.7, 4.9, 0, 0.01)
    s.log += [dict(t=4.5, kind="take", client="x", paired=False)]
    s.log += [dict(t=t, kind="sample", client="x", clutch=True) for t in np.arange(4.5, 5.0, 0.01)]


def an_old_grip(s):
    s.drop("sample", begin=2.99, end=6.995)
    s.log += [dict(t=t, kind="sample", client="o", clutch=True) for t in np.arange(2.99, 6.995, 0.01)]


SUMMARY = "5000 looked at, 0 beyond a limit, 0 in contact"
EVER = slice(None)
SPIED = dict(t=4.1, kind="spied", path="/sessions/a/session.mcap", shows="Authorization: Bearer ", status=200, size=30000)
# Changes to the session: each a call, or several.
DOCTORED = {
    "beyond its position": ("command position", lambda s: s.push(1.0, 3.0, 0, 0.9)),
    "not a number": ("command position", lambda s: s.add("q", 1234, 0, np.nan)),
    "2.5 rad/s": ("command speed", lambda s: s.push(1.5, 2.0, 0, 0.4)),
    "a speed that is told only": ("command speed", lambda s: s.add("dq", 1000, 1, -2.1)),
    "a step between commands": ("command speed", lambda s: s.add("q", slice(1000, None), 1, 0.0045)),
    "a small step, whose second difference is too large": ("command acceleration", lambda s: s.add("q", 1000, 1, 0.0008)),
    "a speed told that bends": ("command acceleration", lambda s: s.add("dq", 1000, 1, 0.05)),
    "an acceleration": ("command acceleration", lambda s: s.push(1.5, 1.9, 0, 0.2)),
    "an acceleration that is told": ("command acceleration", lambda s: s.add("ddq", 1200, 0, 11.5)),
    "a gap made up for": ("command step", lambda s: s.lose(1.4, 1.46)),
    "measured position": ("measured position", lambda s: s.add("state_q", slice(1000, 1003), 0, 0.81)),
    "measured speed": ("measured speed", lambda s: s.add("state_dq", 1100, 0, 2.25)),
    "measured speed by positions": ("measured speed", lambda s: s.add("state_q", slice(1100, None), 0, 0.006)),
    "measured acceleration": ("measured acceleration", lambda s: s.add("state_dq", 1100, 1, 0.05)),
    "measured acceleration by positions": ("measured acceleration", measured_bend),
    "commanded bodies": ("command bodies", lambda s: s.add("q", EVER, 1, -0.401)),
    "measured bodies": ("measured bodies", lambda s: s.add("state_q", EVER, 1, -0.401)),
    "moves again after the release": ("rest", lambda s: s.push(4.7, 4.9, 0, 0.01)),
    "moves again, and nobody's hand": ("no living hand", lambda s: s.push(4.7, 4.9, 0, 0.01)),
    "creeps after the release": ("rest", lambda s: s.push(3.0, 4.8, 0, 0.01)),
    "a stranger moves it": ("no living hand", a_stranger_moves_it),
    "follows the dead, heard until 1.45 s": ("no living hand", lambda s: s.drop("sample", begin=1.05, end=4.0)),
    "follows after the lease was lost": ("no living hand", lambda s: s.log.append(dict(t=1.02, kind="gone", client="o"))),
    "a playback after a stop": ("no living hand", lambda s: (s.request(3.5, "playback", text="carrying"), s.push(6.8, 6.95, 0, 0.001))),
    "a late stop": ("stop obeyed", lambda s: s.stops_at(5.3)),
    "a lost stop": ("stop obeyed", lambda s: s.request(4.0, "stop", "x")),
    "a stop lost beside a reset": ("stop obeyed", lambda s: (reset_at_6_is(s, 5.999), s.request(6.0, "stop"))),
    "no rest after a stop": ("stop obeyed", lambda s: s.push(7.5, 9.4, 0, 0.05)),
    "undone by itself": ("stop undone", reset_at_6_is),
    "undone by a reset before": ("stop undone", lambda s: (s.request(5.9, "stop", "x"), reset_at_6_is(s, 5.8))),
    "reset by a stranger": ("stop undone", lambda s: reset_at_6_is(s, 6.0, "x")),
    "an old grip": ("fresh grip", an_old_grip),
    "hangs": ("ends", lambda s: ends(s, code=None, took=20.0)),
    "crashes": ("ends", lambda s: ends(s, how="gone", code=-11, took=0.0, said="")),
    "ends in disorder": ("ends", lambda s: ends(s, code=2)),
    "ends without a word": ("summary", lambda s: ends(s, said="", unread=True)),
    "says too little": ("summary", lambda s: s.push(1.0, 3.0, 0, 0.9)),
    "commands the terminal": ("terminal", lambda s: ends(s, said="there is no recording '\x1b]0;mine\x07'\n" + SUMMARY)),
    "does not serve": ("served", lambda s: s.log.append(dict(t=4.0, kind="failed", what="a newcomer was not served"))),
    "a recording for anybody": ("unpaired reader", lambda s: s.log.append(SPIED)),
    "a recording lost": ("recordings", lambda s: archive(s, ["a", "label of a"])),
    "a recording in two places": ("recordings", lambda s: archive(s, ["a", "label of a"], ["b", ""], ["b", ""])),
    "a label of another": ("recordings", lambda s: archive(s, ["a", ""], ["b", "label of a"])),
    "recordings without end": ("recordings", lambda s: archive(s, ["a", "label of a"], ["b", ""], recordings=8)),
    "a profile in name only": ("profile speed", lambda s: s.profiles.__setitem__(slice(None), [(0.0, "gentle")])),
}


@pytest.mark.parametrize("rule, doctor", DOCTORED.values(), ids=DOCTORED)
def test_each_rule_finds_what_it_is_for(sheet, rule, doctor):
    doctor(sheet)
    assert rule in sheet.rules()


def a_stop_in_a_pause(s):
    """What was sent while the program was stopped counts from when it could be heard."""
    s.log.append(dict(t=4.98, kind="pause", until=5.28))
    s.lose(4.98, 5.28)
    s.stops_at(5.288)


def granted_long_after_it_was_asked_for(s):
    s.log.insert(2, dict(t=0.1, kind="lease", client="x", holder=2))
    s.log[1]["t"] = 0.05
    s.log.append(dict(t=0.06, kind="take", client="x", paired=True))


ALLOWED = {
    "a stop in a pause": a_stop_in_a_pause,
    "granted long after it was asked for": granted_long_after_it_was_asked_for,
    "a stop, and a reset that is later": lambda s: s.request(5.98, "stop"),
    "a stop on another socket: nobody knows which came first": lambda s: s.request(6.0005, "stop", "x"),
    "what is printed is dropped where nobody reads it": lambda s: ends(s, code=2, took=4.0, said="", unread=True, deaf=True),
    "a profile that the arm slows down to": lambda s: s.profiles.__setitem__(slice(None), [(0.0, "tracking"), (1.6, "gentle")]),
    "killed between recording and label": lambda s: archive(s, ["a", ""], ["b", ""], killed=True),
}


@pytest.mark.parametrize("doctor", ALLOWED.values(), ids=ALLOWED)
def test_what_is_allowed_breaks_nothing(sheet, doctor):
    doctor(sheet)
    assert sheet.rules() == set()
