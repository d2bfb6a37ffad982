"""Cameras of a session, from a simulated scene and from files, as FFmpeg and the mcap package read its recording (docs/how-to/add-a-camera.md)."""

import re
import resource
import signal
import struct
import subprocess
import sys
import time

import numpy as np
import pytest
from mcap.reader import make_reader
from live_client import Client, Demo
from sample import PROGRAM, ROOT

av = pytest.importorskip("av", reason="setup/requirements-dataset.txt is not installed")
sys.path.insert(0, str(ROOT / "bench"))
import cameras  # noqa: E402
from steadyhand.dataset import read_videos  # noqa: E402

HALF_A_FRAME = 0.5 / 15


def demo(folder, *options, seconds=2):
    command = [PROGRAM, "demo", "--headless", "--seconds", str(seconds), "--set", f"recording.folder={folder}", *map(str, options)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120)


HAS_SCENES = demo("/dev/null", "--arm", "mujoco", "--task", "carry", "--camera", "front", "--no-recording", seconds=0.2)
of_scenes = pytest.mark.skipif(HAS_SCENES.returncode != 0, reason=f"no cameras of scenes: {HAS_SCENES.stderr.strip()}")


def film(path, pictures=30, rate=15):
    """A video file with a grey for each picture."""
    with av.open(str(path), "w") as file:
        stream = file.add_stream("libx264", rate=rate)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        for k in range(pictures):
            file.mux(stream.encode(av.VideoFrame.from_ndarray(np.full((48, 64, 3), 30 + 6 * k % 200, np.uint8), format="rgb24")))
        file.mux(stream.encode(None))
    return path


@pytest.mark.long
@of_scenes
def test_a_picture_shows_the_time_at_which_it_was_exposed(tmp_path):
    path, said = cameras.record(tmp_path, 6)
    errors = cameras.skew(path)
    assert len(errors) > 5, said
    assert np.abs(errors).max() < HALF_A_FRAME
    assert "camera above" in said


@of_scenes
def test_two_cameras_film_what_their_names_say(tmp_path):
    done = demo(tmp_path, "--arm", "mujoco", "--task", "carry", "--camera", "front", "--camera", "wrist", "--set", "camera.width=160", "--set", "camera.height=120")
    assert done.returncode == 0, done.stderr
    path = next(tmp_path.glob("*.mcap"))
    videos = read_videos(path)
    assert set(videos) == {"front", "wrist"} and {(each.width, each.height, each.rate) for each in videos.values()} == {(160, 120, 15.0)}
    with path.open("rb") as file:
        schemas = {schema.name for schema, channel, _ in make_reader(file).iter_messages() if channel.topic.startswith("/camera/")}
    assert schemas == {"foxglove.CompressedVideo"}
    for video in videos.values():
        assert np.all(np.diff(video.t) > 0.0)
        decoder = av.CodecContext.create("h264", "r")
        first = decoder.decode(av.Packet(video.packets[0])) or decoder.decode(None)
        assert first[0].to_ndarray(format="rgb24").std() > 10.0  # something is to be seen


def test_a_file_that_ends_is_a_camera_that_was_unplugged_and_the_arm_goes_on(tmp_path):
    done = demo(tmp_path, "--camera", f"table={film(tmp_path / 'film.mp4', pictures=10)}", seconds=4)
    assert done.returncode == 0, done.stderr
    assert "film.mp4: the video ended" in done.stdout and "held or stopped    1 x a stop was asked for\n" in done.stdout, done.stdout
    video = read_videos(next(tmp_path.glob("*.mcap")))["table"]
    assert 1 <= len(video.t) <= 10


def test_who_watches_sees_what_is_filmed_and_that_a_camera_ended(tmp_path):
    short = film(tmp_path / "short.mp4", pictures=5)
    program = Demo(tmp_path, "--no-recording", "--camera", f"table={film(tmp_path / 'film.mp4', pictures=900)}", "--camera", f"short={short}")
    watches, other = program.client(), program.client()
    watches.send(type="watch", cameras=["ceiling"])
    assert "there are table, short" in watches.wait_for("error", code="unknown")["message"]
    watches.send(type="watch", cameras=["table"])
    while len(watches.pictures) < 20:
        watches.messages(0.1)
        other.messages()
    Client(program.port).wait_for("cameras", ended=["", f"{short}: the video ended"])
    program.end()
    assert not other.pictures
    decoder = av.CodecContext.create("h264", "r")
    exposed = []
    for k, (came, message) in enumerate(watches.pictures[:20]):
        kind, key, camera, at = struct.unpack_from("<BBH4xd", message)
        assert (kind, camera) == (1, 0) and (key == 1 or k > 0)
        assert at < came  # one clock on one machine
        exposed.append(at)
        frames = decoder.decode(av.Packet(message[16:]))
        assert [frame.width for frame in frames] == [320]
    assert np.all(np.diff(exposed) > 0.0)


def test_pictures_survive_a_kill(tmp_path):
    command = [PROGRAM, "demo", "--headless", "--set", f"recording.folder={tmp_path}", "--camera", f"table={film(tmp_path / 'film.mp4', pictures=400)}"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    deadline = time.monotonic() + 60.0
    found = {}
    while len(found["table"].t if found else []) < 10:
        assert time.monotonic() < deadline
        time.sleep(0.5)
        found = read_videos(next(tmp_path.glob("*.mcap"))) if any(tmp_path.glob("*.mcap")) else {}
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert len(read_videos(next(tmp_path.glob("*.mcap")))["table"].t) >= 10


@pytest.mark.parametrize(
    "words, reason",
    [
        (["--camera", "front"], "camera 'front'|without =FILE it is a camera of the scene"),
        (["--camera", "table=none.mp4"], "camera 'table': none.mp4: No such file or directory"),
        (["--camera", "table="], "--camera is 'table='; it must be NAME or NAME=FILE"),
        (["--camera", "../x=FILM"], "a camera is named '../x'; it must be of 1 to 60 letters, digits, _ and -"),
        (["--camera", "a=FILM", "--camera", "a=FILM"], "two cameras are named 'a'"),
        (["--camera", "a=FILM", "--set", "camera.width=161"], "camera 'a' has 161 x 240 pixels; both must be even"),
        (["--camera", "a=FILM", "--set", "camera.rate=0"], "camera.rate"),
        (["--camera", "a=TEXT"], "text.mp4: "),
        (["--camera", "a=/dev/null"], "camera 'a': /dev/null: is no camera that Video4Linux2 knows"),
    ],
)
def test_bad_input_moves_nothing(tmp_path, words, reason):
    (tmp_path / "text.mp4").write_text("no video")
    named = [word.replace("FILM", str(film(tmp_path / "film.mp4", 3))).replace("TEXT", str(tmp_path / "text.mp4")) for word in words]
    done = demo(tmp_path, *named)
    assert done.returncode == 2 and any(each in done.stderr for each in reason.split("|")), done.stderr
    assert not any(tmp_path.glob("*.mcap"))


@of_scenes
def test_a_scene_without_the_camera(tmp_path):
    done = demo(tmp_path, "--arm", "mujoco", "--task", "carry", "--camera", "behind")
    assert done.returncode == 2 and "the scene has no camera 'behind'; it has front, wrist" in done.stderr


def test_a_full_disk_ends_the_recording_and_neither_the_session_nor_its_cameras(tmp_path):
    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (400_000, 400_000))

    command = [PROGRAM, "demo", "--headless", "--seconds", "8", "--set", f"recording.folder={tmp_path}", "--camera", f"table={film(tmp_path / 'film.mp4', pictures=200)}"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, preexec_fn=limit)
    assert done.returncode == 0, done.stderr
    assert "the recording ended, the session continues: " in done.stdout and "File too large" in done.stdout
    filmed = re.search(r"^camera table +(\d+) pictures, \d+ dropped$", done.stdout, re.MULTILINE)
    assert int(re.search(r"(\d+) looked at, 0 beyond a limit, 0 in contact", done.stdout)[1]) > 2000
    recorded = read_videos(next(tmp_path.glob("*.mcap")))["table"]
    assert 1 <= len(recorded.t) < int(filmed[1]), done.stdout
    decoder = av.CodecContext.create("h264", "r")
    decoder.flags |= av.codec.context.Flags.low_delay
    assert all(decoder.decode(av.Packet(packet)) for packet in recorded.packets), "each picture is whole"


def test_an_encoder_that_cannot_keep_up_drops_pictures_and_holds_nothing_up(tmp_path):
    large = ["--set", "camera.width=3840", "--set", "camera.height=2160", "--set", "camera.rate=60"]
    done = demo(tmp_path, "--camera", f"table={film(tmp_path / 'film.mp4', pictures=600, rate=60)}", *large, seconds=4)
    assert done.returncode == 0, done.stderr
    filmed, dropped = map(int, re.search(r"^camera table +(\d+) pictures, (\d+) dropped$", done.stdout, re.MULTILINE).groups())
    assert dropped > 50 and filmed + dropped < 600, done.stdout
    assert int(re.search(r"(\d+) looked at, 0 beyond a limit, 0 in contact", done.stdout)[1]) > 1000
    assert "held or stopped    1 x a stop was asked for\n" in done.stdout, done.stdout
    assert len(read_videos(next(tmp_path.glob("*.mcap")))["table"].t) <= filmed
