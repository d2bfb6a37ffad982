"""Finished data sets as one: rows renumbered, statistics computed again, videos unchanged."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from . import _lerobot as lerobot
from ._episodes import Episode

_RENUMBERED = ("episode_index", "index", "task_index")


def is_set(path: str | os.PathLike[str]) -> bool:
    """A finished data set, not a session or a folder of sessions."""
    return (Path(path) / "meta/info.json").is_file()


def merge(folder: str | os.PathLike[str], sets: Sequence[str | os.PathLike[str]], episodes: Sequence[Episode] = ()) -> dict[str, Any]:
    """Makes the data set `folder` of all that is in these, in their order, then of the episodes; or appends that to the one that is there.

    The folder is changed as a whole at the end, and the sets stay as they are; videos are shared with them where the file system can.
    At least one set. Returns what info.json holds. Raises ValueError where robot, rate or features differ, and where a set lacks something or is damaged.
    """
    folder = Path(folder)
    seen = {folder.resolve()}
    for path in map(Path, sets):
        if path.resolve() in seen:
            raise ValueError(f"{path}: named twice")
        seen.add(path.resolve())
    found = [_look_through(Path(path)) for path in sets]
    if episodes:
        lerobot.info_of(episodes)
    first = found[0].info
    for each in found:
        lerobot.must_match(each.info, first, str(each.folder), str(sets[0]))
    with lerobot.being_written(folder) as (beside, before):
        info = before or first | {"total_episodes": 0, "total_frames": 0, "total_tasks": 0}
        for each in found:
            if before:
                lerobot.must_match(each.info, before, str(each.folder), str(folder))
            _take(beside, info, each)
        lerobot.add(beside, info, episodes, str(folder if before else sets[0]))
    return info


def _look_through(folder: Path) -> _Set:
    try:
        return _Set(folder)
    except (KeyError, TypeError, AttributeError, IndexError) as error:
        raise ValueError(f"{folder}: is damaged, or not as this program knows data sets: {error!r}") from None


class _Set:
    """A data set that was looked through: all of it is there, and its parts agree."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.info = lerobot.read_info(folder)
        self.cameras = [name for name, feature in self.info.get("features", {}).items() if feature.get("dtype") == "video"]
        for key, path in (("data_path", lerobot.DATA), ("video_path", lerobot.VIDEOS if self.cameras else None)):
            if self.info.get(key) != path:
                raise ValueError(f"{folder}/meta/info.json: {key} is {self.info.get(key)}; it must be {path}")
        self.tasks = self._read_tasks()
        self.episodes = [(path, self._read(path)) for path in sorted(folder.glob("meta/episodes/*/*.parquet"))]
        rows = [row for _, table in self.episodes for row in table.to_pylist()]
        if len(rows) != self.info["total_episodes"] or [row["episode_index"] for row in rows] != list(range(len(rows))):
            raise ValueError(f"{folder}: meta/episodes has {len(rows)} episodes, or not in their order; info.json says {self.info['total_episodes']}")
        self.frames = self._read_frames(rows)
        for camera in self.cameras:
            for place, count in self._lengths(rows, f"videos/{camera}").items():
                path = self.path(lerobot.VIDEOS, place, camera)
                if (pictures := _pictures(path)) != count:
                    raise ValueError(f"{path}: has {pictures} pictures; its episodes have {count} frames")

    def path(self, kind: str, place: tuple[int, int], camera: str = "") -> Path:
        return self.folder / kind.format(video_key=camera, chunk_index=place[0], file_index=place[1])

    def _read(self, path: Path) -> pa.Table:
        try:
            return pq.read_table(path)
        except FileNotFoundError:
            raise ValueError(f"{path}: is missing") from None
        except (OSError, pa.ArrowInvalid) as error:
            raise ValueError(f"{path}: {error}") from None

    def _read_tasks(self) -> dict[int, str]:
        path = self.folder / "meta/tasks.parquet"
        tasks = self._read(path).to_pandas()
        if len(tasks) != self.info["total_tasks"]:
            raise ValueError(f"{path}: has {len(tasks)} tasks; info.json says {self.info['total_tasks']}")
        return {int(index): str(words) for words, index in tasks["task_index"].items()}

    def _lengths(self, rows: list[dict[str, Any]], kind: str) -> dict[tuple[int, int], int]:
        """Number of frames in each file of a kind, from its episodes."""
        lengths: dict[tuple[int, int], int] = {}
        for row in rows:
            place = row[f"{kind}/chunk_index"], row[f"{kind}/file_index"]
            lengths[place] = lengths.get(place, 0) + row["length"]
        return lengths

    def _read_frames(self, rows: list[dict[str, Any]]) -> dict[tuple[int, int], pa.Table]:
        frames = {}
        for place, count in sorted(self._lengths(rows, "data").items()):
            frames[place] = self._read(self.path(lerobot.DATA, place))
            if len(frames[place]) != count:
                raise ValueError(f"{self.path(lerobot.DATA, place)}: has {len(frames[place])} frames; its episodes have {count}")
        every = pa.concat_tables(frames.values())["index"].to_numpy() if frames else np.zeros(0)
        if len(every) != self.info["total_frames"] or (every != np.arange(len(every))).any():
            raise ValueError(f"{self.folder}: data has {len(every)} frames, or not in their order; info.json says {self.info['total_frames']}")
        return frames


def _pictures(path: Path) -> int:
    """How many there are, by what can be read of the file. Raises ValueError where it cannot be."""
    import av

    if not path.is_file():
        raise ValueError(f"{path}: is missing")
    try:
        with av.open(str(path)) as file:
            return sum(packet.size > 0 and not packet.is_corrupt for packet in file.demux(video=0))
    except (av.FFmpegError, IndexError) as error:
        raise ValueError(f"{path}: {error}") from None


def _take(folder: Path, info: dict[str, Any], each: _Set) -> None:
    """Appends a set to what is being written; statistics and info.json are left to lerobot.add()."""
    number = lerobot.read_tasks(folder, info)
    for _, words in sorted(each.tasks.items()):
        number.setdefault(words, len(number))
    task = np.array([number[each.tasks[index]] if index in each.tasks else -1 for index in range(max(each.tasks, default=-1) + 1)])
    base, per_chunk = lerobot.next_number(folder, info["chunks_size"]), info["chunks_size"]

    def moved(chunk: int, file: int) -> dict[str, int]:
        there = base + chunk * each.info["chunks_size"] + file
        return {"chunk_index": there // per_chunk, "file_index": there % per_chunk}

    frames = []
    for place, table in each.frames.items():
        old = table["task_index"].to_numpy()
        if old.min() < 0 or old.max() >= len(task) or (task[old] < 0).any():
            raise ValueError(f"{each.path(lerobot.DATA, place)}: a task_index that meta/tasks.parquet lacks")
        new = {"episode_index": table["episode_index"].to_numpy() + info["total_episodes"], "index": table["index"].to_numpy() + info["total_frames"], "task_index": task[old]}
        for name, values in new.items():
            at = table.schema.get_field_index(name)
            table = table.set_column(at, table.schema.field(at), pa.array(values).cast(table.schema.field(at).type))
        frames.append(table)
        lerobot.write_table(folder / lerobot.DATA.format(**moved(*place)), table)
    every = pa.concat_tables(frames) if frames else None
    for path, table in each.episodes:
        _write_episodes(folder, info, every, table, moved(*_place_of(path)), moved, each.cameras)
    for camera in each.cameras:
        for path in sorted(each.folder.glob(f"videos/{camera}/*/*.mp4")):
            there = folder / lerobot.VIDEOS.format(video_key=camera, **moved(*_place_of(path)))
            there.parent.mkdir(parents=True, exist_ok=True)
            lerobot.link(str(path), str(there))
    info |= {"total_episodes": info["total_episodes"] + each.info["total_episodes"], "total_frames": info["total_frames"] + each.info["total_frames"]}
    lerobot.write_tasks(folder, info, number)


def _place_of(path: Path) -> tuple[int, int]:
    return int(path.parent.name.removeprefix("chunk-")), int(path.stem.removeprefix("file-"))


def _write_episodes(folder: Path, info: dict[str, Any], frames: pa.Table | None, table: pa.Table, place: dict[str, int], moved: Any, cameras: list[str]) -> None:
    before = next(iter(sorted(folder.glob("meta/episodes/*/*.parquet"))), None)
    if before and (apart := set(pq.read_schema(before).names) ^ set(table.column_names)):
        raise ValueError(f"meta/episodes of what is to be merged differ: only some have {', '.join(sorted(apart))}")
    rows = table.to_pylist()
    for row in rows:
        first = row["dataset_from_index"]
        row["episode_index"] += info["total_episodes"]
        row["dataset_from_index"] += info["total_frames"]
        row["dataset_to_index"] += info["total_frames"]
        for kind in ("data", *(f"videos/{camera}" for camera in cameras)):
            row |= {f"{kind}/{key}": value for key, value in moved(row[f"{kind}/chunk_index"], row[f"{kind}/file_index"]).items()}
        row |= {f"meta/episodes/{key}": value for key, value in place.items()}
        assert frames is not None
        own = frames.slice(first, row["length"]).select(list(_RENUMBERED))
        made = {f"stats/{name}/{key}": value for name, stats in lerobot.statistics(own).items() for key, value in stats.items()}
        row |= {key: value for key, value in made.items() if key in row}
    lerobot.write_table(folder / lerobot.EPISODES.format(**place), pa.Table.from_pylist(rows, schema=table.schema))
