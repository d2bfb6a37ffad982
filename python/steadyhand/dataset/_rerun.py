"""Episodes as Rerun shows them: a folder with a recording (.rrd) of each.

    FEATURE (observation.state, action, ...)    its numbers, named
    world/tool, world/target, world/THING       frames in the base
    observation.images.NAME                     video, as it was encoded, at the times of exposure
    recording properties                        session, start_s, task, success, notes

Timelines: episode (from frame 0) and, except for cameras, frame.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import rerun as rr

from .._arrays import Array
from .._files import umask
from ._episodes import Episode

_APPLICATION = "steadyhand"


def write_rerun(folder: str | os.PathLike[str], episodes: Sequence[Episode]) -> int:
    """Makes the folder, with SESSION-NUMBER.rrd for each episode; how many frames they have. It is there whole, or not at all.

    Raises ValueError where there is no episode, and where the folder is there already.
    """
    folder = Path(folder)
    if not episodes:
        raise ValueError("there is no episode to write")
    if folder.exists():
        raise ValueError(f"{folder} is there already; name another folder")
    folder.parent.mkdir(parents=True, exist_ok=True)
    beside = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.parent))
    try:
        for number, episode in enumerate(episodes):
            _write(beside / f"{episode.session}-{number:03d}.rrd", episode)
        os.chmod(beside, 0o777 & ~umask())
        beside.rename(folder)
    finally:
        shutil.rmtree(beside, ignore_errors=True)
    return sum(map(len, episodes))


def _write(path: Path, episode: Episode) -> None:
    with rr.RecordingStream(_APPLICATION, recording_id=path.stem) as recording:
        recording.save(path)
        recording.send_recording_name(path.stem)
        about = {"session": episode.session, "start_s": episode.start, "fps": episode.fps, "robot": episode.robot, "task": episode.task, "notes": episode.notes}
        success = "unknown" if episode.success is None else str(bool(episode.success)).lower()
        recording.send_property("steadyhand", rr.AnyValues(**about, success=success))
        frame = np.arange(len(episode))
        times = [rr.TimeColumn("episode", duration=frame / episode.fps), rr.TimeColumn("frame", sequence=frame)]
        for name, frames in episode.features.items():
            recording.log(name, rr.SeriesLines(names=list(frames.names)), static=True)
            values = frames.values.astype(np.float64).reshape(len(episode), -1)
            recording.send_columns(name, times, rr.Scalars.columns(scalars=values.ravel()).partition([values.shape[1]] * len(values)))
            for thing, poses in _poses(frames.names, values).items():
                recording.send_columns(f"world/{thing}", times, rr.Transform3D.columns(translation=poses[:, :3], quaternion=poses[:, 3:]))
                recording.log(f"world/{thing}", rr.TransformAxes3D(0.1), static=True)
        for name, film in episode.films.items():
            recording.log(name, rr.VideoStream(codec=rr.VideoCodec.H264), static=True)
            recording.send_columns(name, [rr.TimeColumn("episode", duration=film.t)], rr.VideoStream.columns(sample=film.packets))


def _poses(names: Sequence[str], values: Array) -> dict[str, Array]:
    """The poses among the numbers, by name: (m, 7)."""
    return {name.removesuffix(".x"): values[:, k : k + 7] for k, name in enumerate(names) if name.endswith(".x") and names[k + 6 : k + 7] == (f"{name.removesuffix('.x')}.qw",)}
