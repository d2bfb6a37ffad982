"""Pictures of a session's cameras: read from its recording, laid on an episode's frames, written as MP4."""

from __future__ import annotations

import base64
import json
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from .. import _native
from .._arrays import Array

PICTURE_PAUSE = 0.1
"""s: an episode is left out if a camera pauses longer, unless another is given."""
_TOPIC = "/camera/"
_KEY = re.compile(rb"\x00\x00\x01[\x25\x45\x65]")
"""Of H.264: a slice that needs no picture before."""
_SAMPLED = 100
"""Pictures that an episode's statistics are of, at most."""


@dataclass(frozen=True)
class Video:
    """What a camera filmed in a session."""

    width: int
    height: int
    rate: float
    """Pictures a second, Hz."""
    t: list[float] = field(default_factory=list)
    """s of the session's time: when each picture was exposed."""
    packets: list[bytes] = field(default_factory=list)
    """The same as H.264, a picture each."""


@dataclass(frozen=True)
class Film:
    """What a camera filmed of an episode: a picture for each of its m frames."""

    width: int
    height: int
    packets: list[bytes]
    """H.264, a picture each; the first needs none before."""
    rows: Array
    """(m,), not decreasing: index of each frame's picture in packets."""
    skew: float
    """s, largest, between a frame's time and the exposure of its picture."""
    t: Array
    """s from frame 0: when each of the packets was exposed."""

    def pictures(self) -> Iterator[Array]:
        """m pictures (height, width, 3) of uint8, RGB. Raises ValueError where they cannot be decoded."""
        import av

        decoder = av.CodecContext.create("h264", "r")
        decoder.flags |= av.codec.context.Flags.low_delay
        picture, number = None, -1
        packets = iter(self.packets)
        for row in self.rows:
            while number < row:
                try:
                    for frame in decoder.decode(av.Packet(next(packets))):
                        picture, number = frame, number + 1
                except (av.FFmpegError, StopIteration) as error:
                    raise ValueError(f"picture {number + 1} cannot be decoded: {error}") from None
            yield picture.to_ndarray(format="rgb24")


def read_videos(path: str | os.PathLike[str]) -> dict[str, Video]:
    """By the cameras' names, of a session's recording; of one that was cut short or is damaged, what can be read.

    Raises ValueError for a camera whose channel does not say what it films.
    """
    videos: dict[str, Video] = {}
    channels, messages = _native.read_messages(os.fspath(path), _TOPIC)
    for topic, data in messages:
        name, about = topic.removeprefix(_TOPIC), channels[topic]
        try:
            if name not in videos:
                videos[name] = Video(int(about["width"]), int(about["height"]), float(about["rate_hz"]))
            said = json.loads(data)
            exposed, packet = said["timestamp"]["sec"] + 1e-9 * said["timestamp"]["nsec"], base64.b64decode(said["data"], validate=True)
        except (ValueError, KeyError, TypeError) as error:
            raise ValueError(f"{topic} has a message that is not a frame: {error!r}") from None
        videos[name].t.append(exposed)
        videos[name].packets.append(packet)
    return videos


def lay(name: str, video: Video, t: Array, longest: float = PICTURE_PAUSE) -> Film:
    """The image that was exposed nearest to each frame, at t (s of the session's time). Raises ValueError for a gap above longest, s."""
    exposed = np.array(video.t)
    rows = np.clip(np.searchsorted(exposed, t), 1, max(1, len(exposed) - 1)) if len(exposed) > 1 else np.zeros(len(t), int)
    if len(exposed) > 1:
        rows = rows - (t - exposed[rows - 1] < exposed[rows] - t)
    skew = float(np.abs(exposed[rows] - t).max()) if len(exposed) else np.inf
    inside = exposed[rows[0] : rows[-1] + 1] if len(exposed) else exposed
    pause = max([2.0 * skew, *np.diff(inside)])
    if not np.isfinite(pause):
        raise ValueError(f"camera {name} has no frame; --no-video leaves out video")
    if pause > longest:
        raise ValueError(f"camera {name} has no frame for {1e3 * pause:.0f} ms, longer than {1e3 * longest:.0f}; --picture-pause {np.ceil(10 * pause) / 10:g} accepts it, --no-video leaves out video")
    first = next((k for k in range(rows[0], -1, -1) if _KEY.search(video.packets[k])), None)
    if first is None:
        raise ValueError(f"camera {name} has no key frame before")
    return Film(video.width, video.height, video.packets[first : rows[-1] + 1], rows - first, skew, exposed[first : rows[-1] + 1] - t[0])


def feature(film: Film, fps: int) -> dict[str, Any]:
    """As info.json describes it."""
    about = {"height": film.height, "width": film.width, "codec": "h264", "pix_fmt": "yuv420p", "is_depth_map": False, "fps": fps, "channels": 3}
    return {
        "dtype": "video",
        "shape": [film.height, film.width, 3],
        "names": ["height", "width", "channels"],
        "info": {f"video.{key}": value for key, value in about.items()} | {"has_audio": False},
    }


def write_video(path: Path, films: Sequence[Film], fps: int) -> list[dict[str, Any]]:
    """All pictures of the films, one behind the other; the statistics of each. A key picture every other frame, as policies read them
    in any order."""
    import av

    path.parent.mkdir(parents=True, exist_ok=True)
    statistics = []
    with av.open(str(path), "w", options={"movflags": "faststart"}) as file:
        stream = file.add_stream("libx264", rate=fps, options={"crf": "20", "preset": "veryfast", "g": "2", "bf": "0"})
        stream.width, stream.height, stream.pix_fmt = films[0].width, films[0].height, "yuv420p"
        stream.time_base = stream.codec_context.time_base = Fraction(1, fps)
        number = 0
        for film in films:
            sampled = set(np.linspace(0, len(film.rows) - 1, min(_SAMPLED, len(film.rows))).astype(int))
            seen = []
            for k, picture in enumerate(film.pictures()):
                frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
                frame.pts, frame.time_base = number, Fraction(1, fps)
                number += 1
                file.mux(stream.encode(frame))
                if k in sampled:
                    seen.append(picture)
            statistics.append(_statistics(np.array(seen)))
        file.mux(stream.encode(None))
    return statistics


QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}


def _statistics(pictures: Array) -> dict[str, Any]:
    """Statistics of each colour, from 0 to 1, in the shape (3, 1, 1) that LeRobot broadcasts."""
    values = pictures.reshape(-1, 3) / 255.0
    found = {key: getattr(values, key)(axis=0) for key in ("min", "max", "mean", "std")} | dict(zip(QUANTILES, np.quantile(values, list(QUANTILES.values()), axis=0)))
    return {key: value.reshape(3, 1, 1).tolist() for key, value in found.items()} | {"count": [len(pictures)]}


def together(parts: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Statistics of several as one; of quantiles the mean, as LeRobot does it."""
    counts = np.array([part["count"][0] for part in parts], dtype=float)
    of = {key: np.array([part[key] for part in parts]) for key in ("min", "max", "mean", "std", *QUANTILES)}

    def mean(values: Array) -> Array:
        return np.average(values, axis=0, weights=counts)

    found = {key: mean(of[key]) for key in ("mean", *QUANTILES)} | {"min": of["min"].min(axis=0), "max": of["max"].max(axis=0)}
    found["std"] = np.sqrt(np.maximum(0.0, mean(of["std"] ** 2 + of["mean"] ** 2) - found["mean"] ** 2))
    return {key: value.tolist() for key, value in found.items()} | {"count": [int(counts.sum())]}
