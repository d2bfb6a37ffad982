"""One job for each of many files: here, in processes side by side, or on the machines of a Ray cluster."""

from __future__ import annotations

import concurrent.futures
import contextlib
import os
import re
import socket
import sys
from argparse import Namespace
from collections.abc import Callable, Sequence
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from ._command_line import Parser
from ._replay import Session

Answer = TypeVar("Answer")
_MOST_WORKERS = 64
_RETRIES = 2
"""Retries of a job whose process or machine was lost; a cluster does not report the cause."""


class Workers(NamedTuple):
    """Processes or cluster for the jobs."""

    processes: int = 1
    """On this machine."""
    ray: str | None = None
    """Address of a Ray cluster, whose processes are used instead."""


def add_workers(parser: Parser, what: str) -> None:
    """Adds the options that select processes or a cluster."""
    parser.add_argument("--workers", type=int, default=1, metavar="N", help=f"processes that {what} in parallel (1)")
    parser.add_argument("--ray", metavar="ADDRESS", help=f'a Ray cluster whose machines {what} instead, HOST:PORT, or "auto" for the one of this machine (needs the extra [ray])')


def workers_of(arguments: Namespace) -> Workers:
    """Raises ValueError for invalid values."""
    if not 1 <= arguments.workers <= _MOST_WORKERS:
        raise ValueError(f"--workers is {arguments.workers}; it must be from 1 to {_MOST_WORKERS}")
    if arguments.ray is not None and arguments.workers != 1:
        raise ValueError("--workers and --ray were both given; the cluster has its own workers: leave out --workers")
    if arguments.ray == "":
        raise ValueError('--ray is empty; it must be HOST:PORT of a Ray cluster, or "auto"')
    return Workers(arguments.workers, arguments.ray)


def _repeats(path: Path) -> bool:
    """Whether it holds the seconds before a fault (docs/reference/recordings.md) of a session in the same folder, which has them too."""
    session, fault, number = path.stem.rpartition("-fault-")
    return bool(fault) and number.isdigit() and path.with_stem(session).exists()


def sessions_of(words: Sequence[str]) -> list[Path]:
    """Sessions that are named, and those of folders that are. Raises ValueError for what is not there, or twice."""
    files: list[Path] = []
    for word in words:
        path = Path(word)
        if not path.exists():
            raise ValueError(f"{path}: there is no such file or folder")
        inside = [each for each in sorted(path.glob("*.mcap")) if not _repeats(each)] if path.is_dir() else [path]
        if not inside:
            raise ValueError(f"{path}: has no session (*.mcap)")
        files += inside
    seen: set[Path] = set()
    for path in files:
        if path.resolve() in seen:
            raise ValueError(f"{path}: named twice")
        seen.add(path.resolve())
    return files


def robot_of(session: Session) -> str:
    """The robot that a session names, by name or file. Raises ValueError where it names none."""
    name = session.metadata.get("run", {}).get("robot")
    if not name:
        raise ValueError("does not name its robot; --robot must")
    return name


def do_each(job: Callable[[Path], Answer], files: Sequence[Path], workers: Workers) -> dict[Path, Answer]:
    """What the job makes of each file. A process that dies takes no other file with it: its own is tried again, and is not among the
    answers if that kills again.

    job: can be pickled, and answers for files that are bad; what it raises ends all.
    Raises ValueError where there is no such cluster.
    """
    if workers.ray is not None:
        return _on_cluster(job, files, workers.ray)
    if workers.processes == 1:
        return {path: job(path) for path in files}
    answers = _in_processes(job, files, workers.processes)
    for path in files:
        if path not in answers:
            answers |= _in_processes(job, [path], 1)
    return answers


def _in_processes(job: Callable[[Path], Answer], files: Sequence[Path], processes: int) -> dict[Path, Answer]:
    """What was made until a worker died; all, if none did."""
    answers = {}
    with concurrent.futures.ProcessPoolExecutor(max_workers=processes) as pool:
        jobs = {path: pool.submit(job, path) for path in files}
        for path, each in jobs.items():
            with contextlib.suppress(BrokenProcessPool):
                answers[path] = each.result()
    return answers


def _run(places: list[str], job: bytes, path: Path) -> Any:
    """In a process of the cluster, which may know nothing of this package yet: it looks where we found it."""
    import pickle
    import sys

    sys.path += [place for place in places if place not in sys.path]
    return pickle.loads(job)(path)


def _must_answer(address: str) -> None:
    """Checks that the address answers, because Ray itself tries for minutes. Raises OSError."""
    if named := re.fullmatch(r"(?:ray://)?\[?(.+?)\]?:(\d{1,5})", address):
        socket.create_connection((named[1], int(named[2])), timeout=5.0).close()


def _on_cluster(job: Callable[[Path], Answer], files: Sequence[Path], address: str) -> dict[Path, Answer]:
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # Ray sends no usage statistics
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")  # suppresses a warning of Ray about GPUs
    try:
        import ray
        import ray.exceptions
    except ImportError as error:
        raise ValueError(f"--ray: {error}; the extra [ray] of the package installs it") from None
    try:
        _must_answer(address)
        ray.init(address=address, logging_level="error", log_to_driver=False)
    except (OSError, OverflowError, RuntimeError, ValueError, AssertionError) as error:
        raise ValueError(f"--ray is '{address}'; no Ray cluster answers there: {str(error).splitlines()[0]}") from None
    try:
        ray.cloudpickle.register_pickle_by_value(sys.modules[__name__])
        # Retries only a worker that died: an exception of the job itself is not retried.
        remote = ray.remote(num_cpus=1, max_retries=_RETRIES, retry_exceptions=False)(_run)
        places, pickled = [place for place in sys.path if place], ray.cloudpickle.dumps(job)
        waiting = {remote.remote(places, pickled, path.resolve()): path for path in files}
        answers = {}
        while waiting:
            (done,), _ = ray.wait(list(waiting), num_returns=1)
            path = waiting.pop(done)
            with contextlib.suppress(ray.exceptions.WorkerCrashedError, ray.exceptions.NodeDiedError, ray.exceptions.OutOfMemoryError, ray.exceptions.ObjectLostError):
                try:
                    answers[path] = ray.get(done)
                except ray.exceptions.RayTaskError as error:
                    raise error.cause from None
        return answers
    finally:
        ray.shutdown()
