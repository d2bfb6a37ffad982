"""Live sessions as files: written while they run, read by the public MCAP reader, by `report` and by `replay`."""

import http.client
import json
import math
import re
import resource
import select
import statistics
import subprocess
import time
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader, make_reader
from mcap.records import Chunk
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from live_client import Client, Demo
from places import PROGRAM

SECOND = 1_000_000_000


def demo(folder, *arguments):
    return [PROGRAM, "demo", "--headless", "--sessions", str(folder), *map(str, arguments)]


def run(*arguments, **options):
    return subprocess.run([str(a) for a in arguments], capture_output=True, text=True, timeout=120, **options)


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """A session of some seconds, and what the program said."""
    folder = tmp_path_factory.mktemp("sessions")
    result = run(*demo(folder, "--seconds", 6))
    assert result.returncode == 0, result.stderr
    (path,) = folder.glob("*.mcap")
    assert f"recorded: {path}" in result.stdout
    return path, result.stdout


def messages(path):
    with open(path, "rb") as file:
        return [(channel.topic, message.log_time, message.data) for _, channel, message in make_reader(file, validate_crcs=True).iter_messages()]


def chunk_spans(path):
    """Nanoseconds that each chunk spans."""
    with open(path, "rb") as file:
        try:
            for record in StreamReader(file, emit_chunks=True).records:
                if isinstance(record, Chunk):
                    yield record.message_end_time - record.message_start_time
        except McapError:
            pass


def test_a_session_holds_everything_that_went_through_it(session):
    path, said = session
    counts = Counter(topic for topic, _, _ in messages(path))
    cycles = int(re.search(r"control +(\d+) cycles", said).group(1))
    looked_at = int(re.search(r"commands +(\d+) looked at", said).group(1))
    samples = int(re.search(r"hand +(\d+) samples", said).group(1))
    assert counts["/joint_state"] == cycles and counts["/joint_command"] == looked_at and counts["/operator_sample"] == samples
    for topic in ("/target", "/plan", "/reference", "/plan_step", "/supervision", "/liquid", "/statistics"):
        assert counts[topic] > 2, counts
    with open(path, "rb") as file:
        reader = make_reader(file)
        metadata = {m.name: m.metadata for m in reader.iter_metadata()}
        for schema in reader.get_summary().schemas.values():
            json.loads(schema.data)
    assert metadata["run"]["profile"] == "carry" and metadata["summary"]["beyond_limits"] == "0"
    assert len(json.loads(metadata["robot"]["json"])["joints"]) == 6


def test_commands_are_in_order_and_never_a_cycle_apart_from_their_states(session):
    path, _ = session
    times = [t for topic, t, _ in messages(path) if topic == "/joint_command"]
    assert times == sorted(set(times))
    states = {t for topic, t, _ in messages(path) if topic == "/joint_state"}
    assert set(times) <= states


def test_it_is_listed_reported_and_replayed(session, tmp_path):
    path, _ = session
    listed = run(PROGRAM, "report", "--sessions", path.parent)
    assert str(path) in listed.stdout and "engaged" in listed.stdout

    reported = run(PROGRAM, "report", path)
    assert reported.returncode == 0, reported.stderr
    page = path.with_suffix(".html")
    assert "Carry, scale 0.5" in page.read_text() and str(page) in reported.stdout

    replayed = run(PROGRAM, "replay", path, "--out", tmp_path, "--rate", 50)
    assert replayed.returncode == 0, replayed.stderr
    # The same hand, except for samples that the live gate dropped too, controls an arm again.
    def hand(path):
        return [tuple(json.loads(d)["pose"]["position"].values()) for topic, _, d in messages(path) if topic == "/operator_sample"]

    driven, again = hand(path), hand(tmp_path / "carry/session.mcap")
    assert set(again) <= set(driven) and len(again) > 0.5 * len(driven)
    steps = [json.loads(d) for topic, _, d in messages(tmp_path / "carry/session.mcap") if topic == "/plan_step"]
    assert any(s["engaged"] and max(map(abs, s["dq"])) > 0.1 for s in steps)


def test_a_report_books_each_profile_and_scale_at_its_time(tmp_path):
    demo = Demo(tmp_path)
    try:
        client = Client(demo.port)
        client.send(type="pair", code=demo.code())
        client.wait_for("paired")
        client.send(type="take")
        for settings in ([("profile", {"text": "tracking"})], [("scale", {"value": 0.25})], [("profile", {"text": "carry"})], [("weight", {"text": "lateral", "value": 7})]):
            for kind, more in settings:
                client.send(type="request", kind=kind, **more)
            client.send(type="request", kind="playback", text="carrying")
            time.sleep(1.5)
        client.send(type="request", kind="stop")
        time.sleep(0.5)
    finally:
        demo.end()
    (path,) = tmp_path.glob("*.mcap")
    reported = run(PROGRAM, "report", path)
    assert reported.returncode == 0, reported.stderr
    page = path.with_suffix(".html").read_text()
    data = json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', page, flags=re.S)[1])
    labels = [profile["label"] for profile in data["profiles"]]
    for label in ("Tracking (P1), scale 0.5", "Tracking (P1), scale 0.25", "Carry, scale 0.25, lateral 7"):
        assert label in labels, labels
    by_label = {profile["label"]: profile for profile in data["profiles"]}
    begin, events = data["session"]["zero_s"], data["session"]["motion"]["events"]
    settings = [event["t_s"] - begin for event in events if event["kind"] == "setting" and "Carry" in event["what"] and "lateral 7" in event["what"]]
    assert min(by_label["Carry, scale 0.25, lateral 7"]["t"]) >= settings[0] - 0.05
    assert max(by_label["Tracking (P1), scale 0.25"]["t"]) <= settings[0] + 0.05
    states = [event["what"] for event in events if event["kind"] == "state"]
    assert "engaged" in states and "stopping" in states
    assert len(data["session"]["latency"]["t"]) > 2


def test_a_killed_session_loses_at_most_a_second_and_opens(tmp_path):
    process = subprocess.Popen(demo(tmp_path), stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    try:
        deadline = time.monotonic() + 60.0
        while not any(p.stat().st_size > 100_000 and b"spilled_profile" in p.read_bytes() for p in tmp_path.glob("*.mcap")):
            assert time.monotonic() < deadline and process.poll() is None
            time.sleep(0.05)
    finally:
        process.kill()
        process.wait()
    (path,) = tmp_path.glob("*.mcap")
    found = []
    with open(path, "rb") as file, pytest.raises(McapError):
        for _, channel, message in NonSeekingReader(file, validate_crcs=True).iter_messages(log_time_order=False):
            found.append((channel.topic, message.log_time))
    states = [t for topic, t in found if topic == "/joint_state"]
    assert len(states) > 200
    # Only the open chunk is missing, and chunks hold half a second of the session's time.
    assert statistics.median(chunk_spans(path)) <= 0.6 * SECOND
    assert "cut short" in run(PROGRAM, "report", "--sessions", tmp_path).stdout
    reported = run(PROGRAM, "report", path)
    assert reported.returncode == 0, reported.stderr
    again = run(*demo(tmp_path, "--seconds", 1))  # a killed session leaves nothing in the way
    assert again.returncode == 0 and "0 beyond a limit, 0 in contact" in again.stdout
    assert len(list(tmp_path.glob("*.mcap"))) == 2


def test_a_full_disk_is_told_and_the_session_goes_on(tmp_path):
    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (150_000, 150_000))

    result = run(*demo(tmp_path, "--seconds", 6), preexec_fn=limit)
    assert result.returncode == 0, result.stderr
    assert "the recording ended, the session continues: " in result.stdout and "File too large" in result.stdout
    looked_at = int(re.search(r"(\d+) looked at", result.stdout).group(1))
    assert looked_at > 2000 and "0 beyond a limit, 0 in contact" in result.stdout
    assert "cut short" in run(PROGRAM, "report", "--sessions", tmp_path).stdout


def test_a_folder_that_cannot_be_made_is_told_and_the_session_goes_on(tmp_path):
    (tmp_path / "file").write_text("")
    result = run(*demo(tmp_path / "file/sessions", "--seconds", 1))
    assert result.returncode == 0 and "not recorded: " in result.stdout, result.stdout


def lengthen(path, long, copies):
    """The same session over and over, in one file."""
    with open(path, "rb") as source, open(long, "wb") as target:
        reader, writer = make_reader(source), Writer(target, compression=CompressionType.ZSTD)
        writer.start()
        channels = {}
        recorded = list(reader.iter_messages())
        begin, end = recorded[0][2].log_time, recorded[-1][2].log_time + 2_000_000
        for metadata in reader.iter_metadata():
            writer.add_metadata(metadata.name, metadata.metadata)
        for copy in range(copies):
            for schema, channel, message in recorded:
                if channel.topic not in channels:
                    number = writer.register_schema(schema.name, schema.encoding, schema.data)
                    channels[channel.topic] = writer.register_channel(channel.topic, channel.message_encoding, number, channel.metadata)
                data, shift = message.data, copy * (end - begin)
                if channel.topic == "/plan_step":
                    content = json.loads(data)
                    time_ns = content["timestamp"]["sec"] * SECOND + content["timestamp"]["nsec"] + shift
                    content["timestamp"] = {"sec": time_ns // SECOND, "nsec": time_ns % SECOND}
                    data = json.dumps(content).encode()
                writer.add_message(channels[channel.topic], message.log_time + shift, data, message.publish_time + shift)
        writer.finish()


def memory(pid, figure):
    """MiB, of /proc/PID/status."""
    return int(re.search(rf"{figure}:\s+(\d+) kB", Path(f"/proc/{pid}/status").read_text()).group(1)) / 1024


def helpers_of(pid):
    """Processes that it has started."""
    children = [p.read_text().split() for p in Path(f"/proc/{pid}/task").glob("*/children")]
    return [int(child) for of_task in children for child in of_task]


def test_a_long_report_is_made_beside_the_session_and_not_waited_for(session, tmp_path):
    lengthen(session[0], tmp_path / "long.mcap", 40)
    demo = Demo(tmp_path)
    pid = demo.process.pid
    time.sleep(1.0)
    before = memory(pid, "VmRSS")

    paired = {"Authorization": f"Bearer {demo.client().token}"}

    def ask(path="/sessions/long/report.html", headers=paired):
        connection = http.client.HTTPConnection("127.0.0.1", demo.port, timeout=120)
        connection.request("GET", path, headers=headers)
        return connection

    asked = ask()
    seen = set()
    while not select.select([asked.sock], [], [], 0.005)[0]:
        for helper in helpers_of(pid):
            try:
                nice = Path(f"/proc/{helper}/stat").read_text().rsplit(")", 1)[1].split()[16]
                limits = Path(f"/proc/{helper}/limits").read_text()
            except (FileNotFoundError, ProcessLookupError):
                continue
            seen.add((nice, re.search(r"Max address space +(\w+)", limits).group(1)))
    assert ("19", str(2 << 30)) in seen, seen
    answer = asked.getresponse()
    body = answer.read()
    assert answer.status == 200 and b"Carry, scale 0.5" in body
    assert memory(pid, "VmHWM") - before < 20, "MiB"  # 2 for each recorded minute would be more than that
    motion = json.loads(ask("/sessions/long/motion").getresponse().read())
    assert motion["t_s"][-1] > 200.0
    assert ask("/sessions/none/report.html").getresponse().status == 404
    assert len(ask("/sessions/long/session.mcap").getresponse().read()) == (tmp_path / "long.mcap").stat().st_size
    for part in ("", "/long/motion", "/long/report.html", "/long/session.mcap"):
        refused = ask("/sessions" + part, {}).getresponse()
        assert refused.status == 401 and b"paired" in refused.read(), part

    waiting = [ask() for _ in range(8)]
    time.sleep(0.3)
    helpers = helpers_of(pid)
    begin = time.monotonic()
    demo.end()
    assert time.monotonic() - begin < 8.0  # 2.5 of them to rest
    assert not any(Path(f"/proc/{helper}").exists() for helper in helpers) and waiting


def test_a_refill_is_a_full_glass_while_the_arm_goes_on(tmp_path):
    """At the level that it has; and the recording tells it."""
    demo = Demo(tmp_path)
    client = demo.client()

    def until(condition, what):
        end = time.monotonic() + 60.0
        while not (client.state and condition(client.state)):
            assert time.monotonic() < end, (what, client.state and client.state["tools"][0]["liquid"])
            client.messages(0.05)
            client.stay()

    for message in ({"type": "take"}, {"type": "request", "kind": "profile", "text": "tracking"}, {"type": "request", "kind": "playback", "text": "carrying"}):
        client.send(**message)
    until(lambda state: state["tools"][0]["liquid"]["spilled"], "a spill")
    level = client.state["controls"]["fill"]
    client.send(type="request", kind="refill", value=level)
    assert "unknown" in client.wait_for("error")["message"], "it has a level of its own already"
    client.send(type="request", kind="refill")
    until(lambda state: not state["tools"][0]["liquid"]["spilled"], "a full glass")
    assert client.state["tools"][0]["liquid"]["spilled_share"] == 0.0 and client.state["controls"]["fill"] == level
    assert client.state["controls"]["playback"] >= 0, "the motion goes on"
    demo.end()
    (path,) = tmp_path.glob("*.mcap")
    spilled = [json.loads(data)["spilled"] for topic, _, data in messages(path) if topic == "/liquid"]
    assert "10" in "".join(str(int(each)) for each in spilled), "spilled, then full again"


def test_nothing_is_recorded_if_so_asked(tmp_path):
    assert run(*demo(tmp_path, "--seconds", 1, "--no-recording")).returncode == 0
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["report", "nothing.mcap"], ["nothing.mcap"]),
        (["report", __file__], ["no MCAP file"]),
        (["replay", "SESSION", "--from", "1e6"], ["samples"]),
        (["replay", "SESSION", "--track", "rhand"], ["rhand", "session"]),
        (["report", "SESSION", "--out", "/nowhere/page.html"], ["/nowhere/page.html"]),
    ],
)
def test_bad_input_ends_with_2_and_says_what_is_wrong(session, arguments, words):
    result = run(PROGRAM, *(str(session[0]) if a == "SESSION" else a for a in arguments))
    assert result.returncode == 2, result.stdout + result.stderr
    for word in words:
        assert word in result.stderr, result.stderr


def hand(t):
    """m, to the front and back, slowly."""
    return (0.03 * (1.0 - math.cos(0.8 * t)), 0.0, 0.0)


def episode(folder, lead):
    """The one kept episode of a session in which `lead` leads a first and a second client, cut for a data set, and its commands."""
    steadyhand = pytest.importorskip("steadyhand")
    dataset = pytest.importorskip("steadyhand.dataset", reason="setup/requirements-dataset.txt is not installed")
    program = Demo(folder)
    first, second = program.client(), program.client()
    first.grip()
    first.send(type="request", kind="episode", text="begin", task="to the front")
    first.move(hand, 1.5)
    last = lead(first, second)
    last.send(type="request", kind="episode", text="keep")
    last.wait_for("state", seconds=30.0)
    program.end()
    session = steadyhand.read_session(next(folder.glob("*.mcap")))
    assert [each.kept for each in session.episodes] == [True]
    robot = steadyhand.Robot(session.metadata["run"]["robot"])
    (cut,), left_out = dataset.cut(session, robot, fps=30)
    assert not left_out and cut.task == "to the front"
    t, q = session.commands.t, session.commands.q
    within = (t >= session.episodes[0].begin) & (t <= session.episodes[0].end)
    speeds = np.abs(np.diff(q[within], axis=0)) / np.diff(t[within])[:, None]
    assert (np.diff(t[within]) > 0.0).all() and np.diff(t[within]).max() < 0.05
    assert (speeds <= 1.001 * session.velocity_max).all()
    return session, cut


def test_two_clients_that_switch_in_an_episode_leave_it_whole(tmp_path):
    def lead(first, second):
        second.send(type="ask")
        first.wait_for("lease", yours=True)
        first.sample(hand(0.0), clutch=False)
        first.send(type="answer", grant=True)
        second.wait_for("lease", yours=True)
        second.grip(take=False)
        second.move(hand, 1.5)
        return second

    session, cut = episode(tmp_path, lead)
    grips = [change for change in session.changes if change.state == "engaged" and session.episodes[0].begin < change.t < session.episodes[0].end]
    assert grips, session.changes  # the second's own
    assert len(cut) / 30 > 3.0


def test_a_clock_that_is_set_in_an_episode_leaves_its_frames_on_the_sessions_own(tmp_path):
    def lead(first, _):
        begin = time.monotonic()
        while time.monotonic() < begin + 1.0:
            first.sample(hand(0.0), clutch=True, t_s=time.monotonic() - 100.0)
            first.messages(0.02)
        assert first.state["state"] != "engaged", "a hand of another time leads nothing"
        first.grip(take=False)
        first.move(hand, 1.5)
        return first

    _, cut = episode(tmp_path, lead)
    assert len(cut) / 30 > 3.5
