"""Data sets as robomimic reads them: one HDF5 file, of numbers.

    data                     attributes total (frames), env_args (JSON: env_name, type, env_kwargs)
    data/demo_0              attributes num_samples; session, start_s, task, success, notes: where it is from
    data/demo_0/actions, rewards, dones
    data/demo_0/obs/KEY, next_obs/KEY      each with the attribute names: what each number is
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Sequence
from pathlib import Path

import h5py
import numpy as np

from .._files import umask
from ._episodes import Episode

_GYM = 2
"""Of robomimic's kinds of environment: which makes one by its name, if a policy is to be tried there. We have none of that name."""


def _key(feature: str) -> str:
    """observation.tool is obs/tool; robomimic takes dots for no names."""
    return feature.removeprefix("observation.").replace(".", "_")


def write_robomimic(path: str | os.PathLike[str], episodes: Sequence[Episode]) -> int:
    """Makes the file of the episodes; how many frames it has. It is there whole, or not at all.

    A sample is a frame that has a next one, which is its next_obs; so an episode of m frames has m - 1. A success is a reward of 1 in its last.
    Raises ValueError where there is no episode, where they differ in kind, and where the file is there already.
    """
    path = Path(path)
    if not episodes:
        raise ValueError("there is no episode to write")
    if path.exists():
        raise ValueError(f"{path} is there already; name another file")
    kinds = [{name: frames.names for name, frames in episode.features.items()} for episode in episodes]
    for episode, kind in zip(episodes, kinds):
        if (episode.robot, episode.fps, kind) != (episodes[0].robot, episodes[0].fps, kinds[0]):
            raise ValueError(f"{episode.session} at {episode.start:.1f} s is of another robot, rate or kind than the first episode: one data set holds one kind")
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    os.close(handle)
    try:
        with h5py.File(name, "w") as file:
            total = sum(_write_demo(file.create_group(f"data/demo_{number}"), episode) for number, episode in enumerate(episodes))
            file["data"].attrs["total"] = total
            kwargs = {"robot": episodes[0].robot, "fps": episodes[0].fps}
            file["data"].attrs["env_args"] = json.dumps({"env_name": "steadyhand", "type": _GYM, "env_kwargs": kwargs})
        os.chmod(name, 0o666 & ~umask())
        os.replace(name, path)
    finally:
        Path(name).unlink(missing_ok=True)
    return total


def _write_demo(demo: h5py.Group, episode: Episode) -> int:
    samples = len(episode) - 1
    for name, frames in episode.features.items():
        if name == "action":
            demo.create_dataset("actions", data=frames.values[:-1].astype(np.float32)).attrs["names"] = list(frames.names)
        elif name != "next.success":
            values = frames.values.astype(np.float32).reshape(len(episode), -1)
            for group, part in (("obs", values[:-1]), ("next_obs", values[1:])):
                demo.create_dataset(f"{group}/{_key(name)}", data=part).attrs["names"] = list(frames.names)
    last = np.arange(samples) == samples - 1
    demo.create_dataset("dones", data=last.astype(np.int64))
    demo.create_dataset("rewards", data=(last & bool(episode.success)).astype(np.float32))
    demo.attrs["num_samples"] = samples
    for key, value in (("session", episode.session), ("start_s", episode.start), ("task", episode.task), ("notes", episode.notes)):
        demo.attrs[key] = value
    demo.attrs["success"] = "unknown" if episode.success is None else str(bool(episode.success)).lower()
    return samples
