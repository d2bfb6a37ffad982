"""Data sets in LeRobot's format v3.0: tables in Parquet, what they hold in JSON.

    meta/info.json                              features, counts, rate
    meta/stats.json                             extent, mean and quantiles of each number
    meta/tasks.parquet                          tasks in words
    meta/episodes/chunk-000/file-000.parquet    episodes: length, where they lie, statistics, session and time
    data/chunk-000/file-000.parquet             frames
    videos/NAME/chunk-000/file-000.mp4          pictures of the camera of that name
"""

from __future__ import annotations

import contextlib
import ctypes
import fcntl
import json
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from .._files import umask
from ._episodes import Episode
from ._video import QUANTILES, feature, together, write_video

FORMAT = "v3.0"
FILES_PER_CHUNK = 1000
_INDICES = {"timestamp": "float32", "frame_index": "int64", "episode_index": "int64", "index": "int64", "task_index": "int64"}
_ONE = {"shape": [1], "names": None}
DATA, EPISODES = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet", "meta/episodes/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
VIDEOS = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"


def write(folder: str | os.PathLike[str], episodes: Sequence[Episode]) -> dict[str, Any]:
    """Makes the data set `folder` of the episodes, or appends them to the one that is there. Returns what info.json holds.

    The folder is changed as a whole at the end: a run that is interrupted leaves it as it was.
    Raises ValueError where there is no episode, and where robot, rate or features differ, among them or from the data set's.
    """
    folder = Path(folder)
    if not episodes:
        raise ValueError("there is no episode to write")
    first = info_of(episodes)
    with being_written(folder) as (beside, before):
        info = before or first
        add(beside, info, episodes, str(folder))
    return info


@contextlib.contextmanager
def being_written(folder: Path) -> Iterator[tuple[Path, dict[str, Any] | None]]:
    """A copy of the data set `folder` and what its info.json holds, or an empty folder and None where there is none yet. It takes the
    place of `folder` as a whole, at the end; where anything fails, that stays as it was. One at a time."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    with _alone(folder.parent):
        for left in folder.parent.glob(f"{_beside(folder)}*"):  # by a run that was killed: a running one has the lock
            shutil.rmtree(left, ignore_errors=True)
        before = read_info(folder) if is_there(folder) else None
        beside = Path(tempfile.mkdtemp(prefix=_beside(folder), dir=folder.parent))
        try:
            if before:
                shutil.copytree(folder, beside, dirs_exist_ok=True, copy_function=link)
            yield beside, before
            os.chmod(beside, 0o777 & ~umask())
            _put_in_place(beside, folder)
        finally:
            shutil.rmtree(beside, ignore_errors=True)


def add(folder: Path, info: dict[str, Any], episodes: Sequence[Episode], where: str) -> None:
    """Appends the episodes, if there are any, to what is being written, and makes the statistics of all. `where`: what they must match, for people."""
    if episodes:
        must_match(new_info(episodes[0]), info, "what is to be appended", where)
        _append(folder, info, episodes)
    frames = pa.concat_tables(pq.read_table(path) for path in sorted(folder.glob("data/*/*.parquet")))
    cameras = [name for name, feature in info["features"].items() if feature["dtype"] == "video"]
    _write_json(folder / "meta/stats.json", statistics(frames) | {name: _statistics_of_pictures(folder, name) for name in cameras})
    info["splits"] = {"train": f"0:{info['total_episodes']}"}
    _write_json(folder / "meta/info.json", info)


def _beside(folder: Path) -> str:
    """How names of what is being written begin, in the same folder."""
    return f".{folder.name}.being-written."


@contextlib.contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """One run at a time writes data sets into this folder: of two that append at once, each would take the other's episodes away."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        with contextlib.suppress(OSError):  # a file system without locks
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                print(f"steadyhand: waiting for another run that writes a data set into {folder}", file=sys.stderr)
                fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def info_of(episodes: Sequence[Episode]) -> dict[str, Any]:
    """Content of info.json for a new data set of these. Raises ValueError if they do not fit together."""
    first = new_info(episodes[0])
    for episode in episodes:
        must_match(new_info(episode), first, f"{episode.session} at {episode.start:.1f} s", "the first episode")
    return first


def new_info(episode: Episode) -> dict[str, Any]:
    features: dict[str, Any] = {name: {"dtype": frames.dtype, "shape": [len(frames.names)], "names": list(frames.names)} for name, frames in episode.features.items()}
    features |= {name: feature(film, episode.fps) for name, film in sorted(episode.films.items())}
    return {
        "codebase_version": FORMAT,
        "robot_type": episode.robot,
        "total_episodes": 0,
        "total_frames": 0,
        "total_tasks": 0,
        "chunks_size": FILES_PER_CHUNK,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "fps": episode.fps,
        "splits": {},
        "data_path": DATA,
        "video_path": VIDEOS if episode.films else None,
        "features": features | {name: {"dtype": dtype} | _ONE for name, dtype in _INDICES.items()},
    }


def is_there(folder: Path) -> bool:
    """There is a data set, not only a place for one. Raises ValueError where something else is."""
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"{folder} is a file; a data set is a folder: name another")
    if not folder.exists() or not any(folder.iterdir()):
        return False
    read_info(folder)
    return True


def read_info(folder: Path) -> dict[str, Any]:
    path = folder / "meta/info.json"
    try:
        info = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ValueError(f"{folder} is not empty and no data set: it has no meta/info.json; name another folder") from None
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    if not isinstance(info, dict) or info.get("codebase_version") != FORMAT:
        raise ValueError(f"{path}: codebase_version is {info.get('codebase_version') if isinstance(info, dict) else info!r}; it must be {FORMAT}")
    return info


def must_match(one: dict[str, Any], other: dict[str, Any], what: str, where: str) -> None:
    for key in ("robot_type", "fps", "features"):
        if key == "features" and (apart := set(one[key]) ^ set(other.get(key, {}))):
            words = ", ".join(f"{'has' if name in one[key] else 'lacks'} {name}" for name in sorted(apart))
            raise ValueError(f"{what} {words}; {where} does not: one data set holds one kind (--no-video leaves pictures out)")
        if key == "features" and (apart := {name for name, feature in one[key].items() if feature != other[key][name]}):
            raise ValueError(f"{what}: {', '.join(sorted(apart))} differs; {where} has another: one data set holds one kind")
        if one[key] != other.get(key):
            raise ValueError(f"{what}: {key} is {one[key]}; {where} has {other.get(key)}: one data set holds one kind")


def _append(folder: Path, info: dict[str, Any], episodes: Sequence[Episode]) -> None:
    number = read_tasks(folder, info)
    for episode in episodes:
        number.setdefault(episode.task, len(number))
    place = _next_file(folder, info["chunks_size"])
    filmed = {name: _write_videos(folder, name, episodes, place) for name in episodes[0].films}
    tables, rows = [], []
    for k, episode in enumerate(episodes, start=info["total_episodes"]):
        first = info["total_frames"]
        table = _table(episode, k, first, number[episode.task])
        tables.append(table)
        info["total_frames"] += len(episode)
        rows.append(
            {"episode_index": k, "tasks": [episode.task], "length": len(episode), "dataset_from_index": first, "dataset_to_index": info["total_frames"]}
            | {f"{kind}/{key}": value for kind in ("data", "meta/episodes") for key, value in place.items()}
            | {f"stats/{name}/{key}": value for name, stats in statistics(table).items() for key, value in stats.items()}
            | {key: value for of_camera in filmed.values() for key, value in of_camera[k - info["total_episodes"]].items()}
            | {"session": episode.session, "session_start_s": episode.start, "success": episode.success, "notes": episode.notes}
        )  # fmt: skip
    info["total_episodes"] += len(episodes)
    write_table(folder / DATA.format(**place), pa.concat_tables(tables))
    table = pa.Table.from_pylist(rows)
    at = table.column_names.index("success")
    write_table(folder / EPISODES.format(**place), table.set_column(at, "success", table.column(at).cast(pa.bool_())))
    write_tasks(folder, info, number)


def read_tasks(folder: Path, info: dict[str, Any]) -> dict[str, int]:
    """Numbers of the tasks in words."""
    tasks = pd.read_parquet(folder / "meta/tasks.parquet") if info["total_tasks"] else pd.DataFrame({"task_index": pd.Series(dtype="int64")})
    return {str(words): int(index) for words, index in tasks["task_index"].items()}


def write_tasks(folder: Path, info: dict[str, Any], number: dict[str, int]) -> None:
    info["total_tasks"] = len(number)
    _replace(folder / "meta/tasks.parquet", lambda path: pd.DataFrame({"task_index": list(number.values())}, index=list(number)).to_parquet(path))


def _write_videos(folder: Path, name: str, episodes: Sequence[Episode], place: dict[str, int]) -> list[dict[str, Any]]:
    """A camera's pictures; what each episode's row says of them."""
    films = [episode.films[name] for episode in episodes]
    try:
        statistics = write_video(folder / VIDEOS.format(video_key=name, **place), films, episodes[0].fps)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None
    ends = np.cumsum([len(episode) for episode in episodes]) / episodes[0].fps
    return [
        {f"videos/{name}/{key}": value for key, value in place.items()}
        | {f"videos/{name}/from_timestamp": float(end - len(episode) / episode.fps), f"videos/{name}/to_timestamp": float(end)}
        | {f"stats/{name}/{key}": value for key, value in of_film.items()}
        | {f"skew_s/{name}": film.skew}
        for episode, film, end, of_film in zip(episodes, films, ends, statistics)
    ]


def _statistics_of_pictures(folder: Path, name: str) -> dict[str, Any]:
    prefix = f"stats/{name}/"
    rows = [row for path in sorted(folder.glob("meta/episodes/*/*.parquet")) for row in pq.read_table(path).to_pylist()]
    return together([{key.removeprefix(prefix): value for key, value in row.items() if key.startswith(prefix)} for row in rows])


def _next_file(folder: Path, per_chunk: int) -> dict[str, int]:
    number = next_number(folder, per_chunk)
    return {"chunk_index": number // per_chunk, "file_index": number % per_chunk}


def next_number(folder: Path, per_chunk: int) -> int:
    """Chunk and file number that no kind has yet: data sets of other programs have more files of one kind than of another."""
    taken = [re.fullmatch(r"chunk-(\d+)/file-(\d+)\.\w+", f"{path.parent.name}/{path.name}") for path in folder.glob("**/chunk-*/file-*")]
    return max((int(match[1]) * per_chunk + int(match[2]) + 1 for match in taken if match), default=0)


def _table(episode: Episode, number: int, first: int, task: int) -> pa.Table:
    m = len(episode)
    columns: dict[str, pa.Array] = {}
    for name, frames in episode.features.items():
        flat = pa.array(frames.values.astype(frames.dtype).ravel())
        columns[name] = flat if len(frames.names) == 1 else pa.FixedSizeListArray.from_arrays(flat, len(frames.names))
    frame = np.arange(m, dtype=np.int64)
    columns["timestamp"] = pa.array((frame / episode.fps).astype(np.float32))
    columns["frame_index"] = pa.array(frame)
    columns["episode_index"] = pa.array(np.full(m, number))
    columns["index"] = pa.array(first + frame)
    columns["task_index"] = pa.array(np.full(m, task))
    return pa.table(columns)


def statistics(table: pa.Table) -> dict[str, dict[str, list[float]]]:
    """Statistics of each number of each column."""
    found = {}
    for name in table.column_names:
        column = table.column(name).combine_chunks()
        values = np.asarray(column.flatten() if pa.types.is_fixed_size_list(column.type) else column, dtype=np.float64).reshape(len(column), -1)
        found[name] = {key: getattr(values, key)(axis=0).tolist() for key in ("min", "max", "mean", "std")} | {"count": [len(values)]}
        found[name] |= {key: row.tolist() for key, row in zip(QUANTILES, np.quantile(values, list(QUANTILES.values()), axis=0))}
    return found


def link(source: str, target: str) -> None:
    """Links a file, or copies it: existing files are never changed in place, so both data sets may share it."""
    try:
        os.link(source, target)
    except OSError:
        shutil.copy2(source, target)


def _replace(path: Path, write_to: Any) -> None:
    """Writes a new file: the existing one may be shared with the previous data set."""
    path.unlink(missing_ok=True)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_to(path)


def write_table(path: Path, table: pa.Table) -> None:
    _replace(path, lambda new: pq.write_table(table, new, compression="snappy"))


def _write_json(path: Path, value: Any) -> None:
    _replace(path, lambda new: new.write_text(json.dumps(value, indent=4) + "\n", encoding="utf-8"))


def _put_in_place(new: Path, folder: Path) -> None:
    """In one step where the system can exchange two folders, so that a run that is killed leaves the one or the other."""
    if not folder.exists():
        new.rename(folder)
    elif not _exchange(new, folder):
        before = new.with_name(new.name + ".before")
        folder.rename(before)
        try:
            new.rename(folder)
        except OSError:
            before.rename(folder)
            raise
        shutil.rmtree(before, ignore_errors=True)


def _exchange(one: Path, other: Path) -> bool:
    """Whether it was done: Linux alone can, on most of its file systems."""
    here, swap = -100, 2  # AT_FDCWD, RENAME_EXCHANGE
    try:
        return ctypes.CDLL(None).renameat2(here, os.fsencode(one), here, os.fsencode(other), swap) == 0
    except (AttributeError, OSError):
        return False
