"""What is kept of a study: a folder with a file for each thing, so that a run that is killed loses the trial under way and no other.

    FOLDER/study.yaml                  the study, as it was read
    FOLDER/schedule.csv                who has which condition when
    FOLDER/participants/P01/consent.json, answers.csv
    FOLDER/participants/P01/trials/005-CONDITION-TASK-1.csv and .mcap

A trial counts as finished once its CSV is there; it is written last, and renamed into place.
"""

from __future__ import annotations

import csv
import fcntl
import io
import json
import math
import os
import re
import shutil
from pathlib import Path
from typing import Any, NamedTuple

from .._files import csv_of, write_whole
from .measures import UNDEFINED, Row
from .study_file import Study, StudyError
from .trial import Condition, Trial

KEEP_FREE = 100e6  # bytes of free disk below which no trial starts


class Planned(NamedTuple):
    """A trial of the schedule. number: from 1, in the order that the participant has them."""

    participant: str
    number: int
    period: int
    """At which place of the order its condition comes, from 1."""
    condition: str
    task: str
    repetition: int
    """From 1; 0: training."""

    @property
    def stem(self) -> str:
        plain = re.sub(r"[^\w.+-]+", "-", f"{self.condition}-{self.task}".lower())
        return f"{self.number:03}-{plain}-{self.repetition or 'training'}"


COLUMNS = ("participant", "number", "period", "condition", "profile", "scale", "latency_s", "path", "task", "repetition", "goal", "measure",
           "value", "unit")  # fmt: skip


AGAIN = ". Take the file away, and the same command does that trial again"


ANSWERS = ("participant", "condition", "key", "value")


class TrialRow(NamedTuple):
    """A row of a trial's CSV, as far as the analysis reads it."""

    participant: str
    period: int
    condition: str
    task: str
    repetition: int
    goal: int
    measure: str
    value: float


def trial_rows(path: Path) -> list[TrialRow]:
    """Rows of a trial's CSV. Raises StudyError with file and line for an invalid or truncated row."""
    found = []
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise StudyError(f"{path} is no text in UTF-8{AGAIN}") from None
    reader = csv.DictReader(io.StringIO(text))
    if tuple(reader.fieldnames or ()) != COLUMNS:
        raise StudyError(f"{path} has not the columns {','.join(COLUMNS)}{AGAIN}")
    for line, row in enumerate(reader, 2):
        try:
            if None in row:  # more cells than columns
                raise ValueError
            each = TrialRow(row["participant"], int(row["period"]), row["condition"], row["task"], int(row["repetition"]), int(row["goal"]),
                            row["measure"], float(row["value"]))  # fmt: skip
            stem = Planned(each.participant, int(row["number"]), each.period, each.condition, each.task, each.repetition).stem
        except (TypeError, ValueError):
            raise StudyError(f"{path}:{line} is {','.join(map(str, row.values()))}; number, goal, period and repetition must be whole numbers, "
                             f"value a number{AGAIN}") from None  # fmt: skip
        if not math.isfinite(each.value) and each.measure not in UNDEFINED:
            raise StudyError(f"{path}:{line}: {each.measure} is {each.value}; it must be finite{AGAIN}")
        if stem != path.stem or each.participant != path.parts[-3]:
            raise StudyError(f"{path}:{line} is of another trial, {each.participant}'s {stem}{AGAIN}")
        found.append(each)
    if not found or not text.endswith("\n"):
        raise StudyError(f"{path} ends in the middle, after {len(found)} rows{AGAIN}")
    return found


class Folder:
    """A study's folder, held by one process at a time."""

    def __init__(self, path: Path) -> None:
        self.path = Path(path)

    def hold(self) -> None:
        """Raises StudyError if another process has it."""
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            self._lock = open(self.path / ".lock", "w")
        except OSError as error:
            raise StudyError(f"{self.path} cannot be written: {error.strerror}") from None
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise StudyError(f"{self.path} is in use by another run of this study; end that one first, or name another folder with --out") from None

    def begin(self, study: Study, schedule: list[list[Planned]], simulated: bool) -> None:
        """Writes study and schedule; where there are some already, they must be the same."""
        self.has_room()
        kept = self.path / "study.yaml"
        head = f"# {len(schedule)}{' simulated' if simulated else ''} participants\n".encode()
        if kept.exists() and kept.read_bytes() != head + study.text.encode():
            raise StudyError(
                f"{kept} is another study than {study.path}, has another number of participants, or people where these are simulated: go on with "
                "that one, or name another folder with --out"
            )
        rows = [each for participant in schedule for each in participant]
        for planned in rows:
            if self.finished(planned):
                trial_rows(self.trial(planned, ".csv"))
        for who in dict.fromkeys(each.participant for each in rows):
            self.consented(who)
            self.answers(who)
        if kept.exists():
            self.check_schedule(schedule)
        write_whole(self.path / "schedule.csv", csv_of(Planned._fields, rows))
        write_whole(kept, head + study.text.encode())

    def check_schedule(self, schedule: list[list[Planned]]) -> None:
        """Raises StudyError if schedule.csv is there and says anything else than the study: it is for people; the program does not read it."""
        path = self.path / "schedule.csv"
        expected = csv_of(Planned._fields, [each for participant in schedule for each in participant]).decode().split("\n")
        if not path.exists():
            return
        kept = path.read_text(encoding="utf-8", errors="replace").split("\n")
        for line, (is_there, follows) in enumerate(zip(kept + [""] * len(expected), expected), 1):
            if is_there != follows:
                raise StudyError(f"{path}:{line} is '{is_there}'; of study.yaml follows '{follows}', which is what was and will be done. Take the file away, "
                                 "and the same command writes it again")  # fmt: skip

    def has_room(self) -> None:
        free = shutil.disk_usage(self.path).free
        if free < KEEP_FREE:
            raise StudyError(f"the disk of {self.path} has {free / 1e6:.0f} MB left; {KEEP_FREE / 1e6:.0f} MB are needed. Finished trials are kept: "
                             "make room and run the same command again")  # fmt: skip

    def participant(self, who: str) -> Path:
        return self.path / "participants" / who

    def trial(self, planned: Planned, ending: str) -> Path:
        return self.participant(planned.participant) / "trials" / (planned.stem + ending)

    def finished(self, planned: Planned) -> bool:
        return self.trial(planned, ".csv").exists()

    def deleted(self, who: str) -> bool:
        return (self.path / "deleted" / who).exists()

    def write_trial(self, planned: Planned, condition: Condition, rows: list[Row], mcap: bytes) -> None:
        """Raises StudyError for a trial with values that are not finite: nothing is written of it."""
        for row in rows:
            if not math.isfinite(row.value) and row.measure not in UNDEFINED:
                raise StudyError(f"{planned.participant}, {planned.stem}: {row.measure} is {row.value}; the trial is not kept, and the same command does it again")
        head = (planned.participant, planned.number, planned.period, planned.condition, condition.profile, condition.scale, condition.latency,
                condition.path, planned.task, planned.repetition)  # fmt: skip
        write_whole(self.trial(planned, ".mcap"), mcap)
        write_whole(self.trial(planned, ".csv"), csv_of(COLUMNS, ((*head, row.goal, row.measure, repr(float(row.value)), row.unit) for row in rows)))

    def write_consent(self, who: str, text: str, agreed: bool, when: str) -> None:
        write_whole(self.participant(who) / "consent.json", json.dumps({"text": text, "agreed": agreed, "when": when}, indent=1).encode())

    def consented(self, who: str) -> bool:
        path = self.participant(who) / "consent.json"
        try:
            return path.exists() and json.loads(path.read_text(encoding="utf-8"))["agreed"] is True
        except (ValueError, TypeError, KeyError):
            raise StudyError(f"{path} is no consent that `study` wrote; take the file away, and the participant is asked again") from None

    def answers(self, who: str) -> list[dict[str, str]]:
        """Rows of participant, condition ("": of all), key, value."""
        path = self.participant(who) / "answers.csv"
        if not path.exists():
            return []
        try:
            reader = csv.DictReader(io.StringIO(path.read_text(encoding="utf-8")))
            rows = list(reader)
            good = tuple(reader.fieldnames or ()) == ANSWERS and all(None not in row and row["value"] and int(row["value"]) >= 0 for row in rows)
        except ValueError:
            good = False
        if not good:
            raise StudyError(f"{path} has not the columns {','.join(ANSWERS)} with whole numbers for values; take the file away, and the questions "
                             "are asked again")  # fmt: skip
        return rows

    def add_answers(self, who: str, condition: str, answers: dict[str, int]) -> None:
        rows = [tuple(row.values()) for row in self.answers(who) if row["condition"] != condition or row["key"] not in answers]
        rows += [(who, condition, key, str(value)) for key, value in answers.items()]
        write_whole(self.participant(who) / "answers.csv", csv_of(ANSWERS, rows))

    def delete(self, who: str) -> None:
        """Everything of a participant, for good; that there was one is kept, so that the id is not given again."""
        folder = self.participant(who)
        if not re.fullmatch(r"P\d+", who) or not folder.is_dir():
            known = sorted(each.name for each in (self.path / "participants").glob("P*"))
            raise StudyError(f"{self.path} has no participant {who!r}; there are {', '.join(known) or 'none'}")
        write_whole(self.path / "deleted" / who, b"")
        shutil.rmtree(folder)


_SCHEMAS = {
    "/operator_sample": "foxglove.PoseInFrame", "/target": "foxglove.PoseInFrame", "/glass": "foxglove.PoseInFrame",
    "/joint_state": "steadyhand.JointState", "/study": "steadyhand.Study",
}  # fmt: skip


def _time(ns: int) -> str:
    return f'{{"sec":{ns // 10**9},"nsec":{ns % 10**9}}}'


def _pose(ns: int, frame: str, p: Any, more: str = "") -> bytes:
    x, y, z = p
    return (f'{{"timestamp":{_time(ns)},"frame_id":"{frame}","pose":{{"position":{{"x":{x:.6g},"y":{y:.6g},"z":{z:.6g}}},'
            f'"orientation":{{"x":0,"y":0,"z":0,"w":1}}}}{more}}}').encode()  # fmt: skip


def to_mcap(trial: Trial, planned: Planned, condition: Condition, study: Study) -> bytes:
    """The trial as MCAP with JSON messages, in the topics of docs/reference/recordings.md as far as there are some, 100 times a second."""
    tools = next(task for task in study.tasks if task.name == planned.task).tools
    from mcap.writer import CompressionType, Writer

    out = io.BytesIO()
    writer = Writer(out, compression=CompressionType.ZSTD)
    writer.start(library="steadyhand study")
    ids = {name: writer.register_schema(name, "jsonschema", b'{"type":"object"}') for name in sorted(set(_SCHEMAS.values()))}
    channels = {topic: writer.register_channel(topic, "json", ids[name]) for topic, name in _SCHEMAS.items()}
    run = {"robot": study.robot.name, "profile": condition.profile, "scale": repr(condition.scale), "yaw_deg": "0", "rate_hz": repr(study.rate),
           "study": study.name, "participant": planned.participant, "condition": planned.condition, "task": planned.task,
           "repetition": str(planned.repetition), "latency_s": repr(condition.latency), "path": condition.path}  # fmt: skip
    writer.add_metadata("run", run)
    writer.add_metadata("robot", {"json": study.robot._native.json})
    sequence = 0
    held_json = {}
    for i, t in enumerate(trial.track.t):
        ns = round(t * 1e9)
        for tool, track in zip(tools, [trial.track, *(each.track for each in trial.others)]):
            numbers = ",".join(f"{v:.6g}" for v in track.q[i]), ",".join(f"{v:.6g}" for v in track.dq[i])
            held = held_json.setdefault(track.held_back[i], json.dumps(track.held_back[i]))
            which = f',"tool":{tool}' if tool else ""
            messages = {
                "/operator_sample": _pose(ns, "operator", track.hand[i], ',"clutch":true,"tracked":true,"emulated":false,"lead_s":0' + which),
                "/target": _pose(ns, "base", track.target[i], ',"engaged":true' + which),
                "/glass": _pose(ns, "base", track.glass[i], which),
                "/joint_state": f'{{"timestamp":{_time(ns)},"q":[{numbers[0]}],"dq":[{numbers[1]}]}}'.encode(),
                "/study": f'{{"timestamp":{_time(ns)},"goal":{track.goal[i]},"held_back":{held},"freeboard":{track.freeboard[i]:.5g},'
                          f'"spilled_share":{track.spilled_share[i]:.6g}{which}}}'.encode(),
            }  # fmt: skip
            for topic, data in messages.items():
                if topic != "/joint_state" or track is trial.track:
                    writer.add_message(channels[topic], ns, data, ns, sequence)
        sequence += 1
    writer.finish()
    return out.getvalue()
