"""Pictures of cameras in data sets (docs/how-to/record-data.md), as FFmpeg decodes them."""

import json
from fractions import Fraction

import numpy as np
import pytest

av = pytest.importorskip("av", reason="setup/requirements-dataset.txt is not installed")
pd = pytest.importorskip("pandas", reason="setup/requirements-dataset.txt is not installed")
from steadyhand import dataset  # noqa: E402
from steadyhand.dataset import Episode, Frames, Video  # noqa: E402
from steadyhand.dataset._video import lay  # noqa: E402

KEY = "observation.images.front"


def grey(k):
    """What picture k of a camera shows."""
    return 30 + 6 * k


def video(t, width=64, height=48):
    """Pictures exposed at t, each with a grey of its own; a key picture every fifth."""
    encoder = av.CodecContext.create("libx264", "w")
    encoder.width, encoder.height, encoder.pix_fmt, encoder.framerate, encoder.time_base = width, height, "yuv420p", 15, Fraction(1, 15)
    encoder.options = {"tune": "zerolatency", "x264-params": "scenecut=0:keyint=5", "crf": "10"}
    filmed = Video(width, height, 15.0, list(t))
    for k in range(len(t)):
        frame = av.VideoFrame.from_ndarray(np.full((height, width, 3), grey(k), np.uint8), format="rgb24")
        frame.pts = k
        filmed.packets.extend(bytes(packet) for packet in encoder.encode(frame))
    assert len(filmed.packets) == len(t)
    return filmed


def episode(film, frames=20, number=0, fps=30):
    action = np.cumsum(np.random.default_rng(number).normal(size=(frames, 6)), axis=0)
    features = {"observation.state": Frames(action, tuple("abcdef")), "action": Frames(action, tuple("abcdef"))}
    return Episode(f"session-{number}", 0.0, fps, "ur5e", "a task", features, films={KEY: film} if film else {})


def shown(path):
    with av.open(str(path)) as file:
        return [(float(frame.time), frame.to_ndarray(format="rgb24")) for frame in file.decode(video=0)]


def test_each_frame_shows_the_picture_that_was_exposed_nearest(tmp_path):
    exposed = 0.31 + np.arange(30) / 15 + np.random.default_rng(2).uniform(-0.005, 0.005, 30)
    t = 0.8 + np.arange(20) / 30
    film = lay("front", video(exposed), t)
    nearest = np.abs(t[:, None] - exposed).argmin(axis=1)
    assert film.skew == pytest.approx(np.abs(exposed[nearest] - t).max()) and film.skew < 0.5 / 15 + 0.006
    info = dataset.write(tmp_path / "set", [episode(film)])
    frames = shown(tmp_path / f"set/videos/{KEY}/chunk-000/file-000.mp4")
    np.testing.assert_allclose([at for at, _ in frames], np.arange(20) / 30, atol=1e-4)
    np.testing.assert_allclose([picture.mean() for _, picture in frames], [grey(k) for k in nearest], atol=2.5)  # greys are 6 apart
    assert info["features"][KEY]["shape"] == [48, 64, 3] and info["features"][KEY]["info"]["video.codec"] == "h264"
    stats = json.loads((tmp_path / "set/meta/stats.json").read_text())[KEY]
    assert np.array(stats["mean"]).shape == (3, 1, 1)
    np.testing.assert_allclose(np.ravel(stats["mean"]), np.mean([grey(k) for k in nearest]) / 255, atol=0.01)


def test_appended_episodes_have_a_file_of_their_own(tmp_path):
    exposed = np.arange(30) / 15
    first = [episode(lay("front", video(exposed), begin + np.arange(20) / 30), number=k) for k, begin in enumerate((0.2, 1.0))]
    dataset.write(tmp_path / "set", first)
    dataset.write(tmp_path / "set", [episode(lay("front", video(exposed), 0.6 + np.arange(20) / 30), number=2)])
    rows = pd.concat([pd.read_parquet(path) for path in sorted((tmp_path / "set").glob("meta/episodes/*/*"))]).to_dict("records")
    assert [(row[f"videos/{KEY}/file_index"], round(row[f"videos/{KEY}/from_timestamp"], 4), round(row[f"videos/{KEY}/to_timestamp"], 4)) for row in rows] == [
        (0, 0.0, 0.6667),
        (0, 0.6667, 1.3333),
        (1, 0.0, 0.6667),
    ]
    for row, begin in zip(rows, (0.2, 1.0, 0.6)):
        frames = shown(tmp_path / f"set/videos/{KEY}/chunk-000/file-{row[f'videos/{KEY}/file_index']:03d}.mp4")
        of_episode = [picture.mean() for at, picture in frames if row[f"videos/{KEY}/from_timestamp"] - 1e-3 <= at < row[f"videos/{KEY}/to_timestamp"] - 1e-3]
        assert len(of_episode) == 20
        assert of_episode[0] == pytest.approx(grey(round(15 * begin)), abs=2.5)
    assert json.loads((tmp_path / "set/meta/stats.json").read_text())[KEY]["count"] == [60]


def test_pauses_and_what_begins_too_late_are_refused():
    t = 0.5 + np.arange(20) / 30
    exposed = np.arange(30) / 15
    lost = np.delete(exposed, [12])  # one picture
    with pytest.raises(ValueError, match="camera front has no frame for 133 ms"):
        lay("front", video(lost), t)
    assert lay("front", video(lost), t, longest=0.15).skew == pytest.approx(1 / 15, abs=0.02)
    with pytest.raises(ValueError, match="camera front has no frame for"):
        lay("front", video(exposed[:12]), t)  # unplugged
    with pytest.raises(ValueError, match="camera front has no frame"):
        lay("front", Video(64, 48, 15.0), t)
    whole = video(exposed)
    headless = Video(64, 48, 15.0, whole.t[6:], whole.packets[6:])
    with pytest.raises(ValueError, match="camera front has no key frame before"):
        lay("front", headless, t)


def test_sessions_without_video_beside_others_are_refused(tmp_path):
    film = lay("front", video(np.arange(30) / 15), 0.2 + np.arange(20) / 30)
    with pytest.raises(ValueError, match="session-1 at 0.0 s lacks observation.images.front; the first episode does not: .*--no-video"):
        dataset.write(tmp_path / "set", [episode(film), episode(None, number=1)])
    assert not (tmp_path / "set").exists()
    dataset.write(tmp_path / "set", [episode(film)])
    with pytest.raises(ValueError, match="what is to be appended lacks observation.images.front"):
        dataset.write(tmp_path / "set", [episode(None, number=1)])
    small = lay("front", video(np.arange(30) / 15, 32, 24), 0.2 + np.arange(20) / 30)
    with pytest.raises(ValueError, match="observation.images.front differs"):
        dataset.write(tmp_path / "set", [episode(small, number=1)])
    assert len(shown(tmp_path / f"set/videos/{KEY}/chunk-000/file-000.mp4")) == 20


def test_a_broken_picture_leaves_nothing_half_written(tmp_path):
    film = lay("front", video(np.arange(30) / 15), 0.2 + np.arange(20) / 30)
    film.packets[0] = b"no picture"
    with pytest.raises(ValueError, match="observation.images.front: picture 0 cannot be decoded"):
        dataset.write(tmp_path / "set", [episode(film)])
    assert not any(tmp_path.iterdir())
