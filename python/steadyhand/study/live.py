"""A study with people: the experimenter at the terminal, the participant at the page."""

from __future__ import annotations

import ctypes
import os
import re
import select
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .measures import measure
from .operator import STEP, Goal
from .._page_client import Lost, PageClient
from .._places import program as find_program
from .questionnaires import Item, items_of, pair_items
from .record import Folder, Planned, to_mcap
from .run import schedule_of
from .study_file import Study, StudyError
from .tasks import Courses, Task
from .trial import ONE_INSTANT_IK, Condition, Track, Trial

START_RADIUS, START_HOLD = 0.03, 0.5  # m and s: where the glass must be before a trial starts
MOST_LATENCY = 1.0  # s, that the program adds on the command path
SILENT = 1.0  # s without a state after which a trial is done again


class Again(Exception):
    """The trial under way cannot count, with the reason."""


def _end_with_parent() -> None:
    """Ends the program like Ctrl-C when the process of the study is killed."""
    pr_set_pdeathsig = 1
    ctypes.CDLL(None).prctl(pr_set_pdeathsig, signal.SIGINT)


class Program:
    """`steadyhand demo` for one participant, whose sessions it records in their folder."""

    def __init__(self, study: Study, sessions: Path, port: int, condition: Condition) -> None:
        sessions.mkdir(parents=True, exist_ok=True)
        browser = [] if os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY") else ["--no-browser"]
        self._process = subprocess.Popen(
            [find_program(), "demo", *browser, "--port", str(port), "--sessions", str(sessions), "--robot", study.robot.source,
             "--profile", condition.profile, "--scale", str(condition.scale)],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True, preexec_fn=_end_with_parent,
        )  # fmt: skip
        self.port, self.address = 0, ""
        said = []
        assert self._process.stdout is not None
        for line in self._process.stdout:
            said.append(line)
            if found := re.match(r"open +(http://[^:]+:(\d+)/\S*)", line):
                self.address, self.port = found.group(1), int(found.group(2))
                break
        if not self.port:
            raise StudyError("steadyhand did not start: " + " ".join("".join(said[-3:]).split()))
        os.set_blocking(self._process.stdout.fileno(), False)

    def news(self) -> str:
        """A new address, once the last code was used."""
        assert self._process.stdout is not None
        try:
            text = self._process.stdout.read() or ""
        except (BlockingIOError, TypeError):
            return ""
        found = re.findall(r"open +(http://\S+)", text)
        return found[-1] if found else ""

    def end(self) -> None:
        self._process.send_signal(signal.SIGINT)
        try:
            self._process.wait(10.0)
        except subprocess.TimeoutExpired:
            self._process.kill()


class Leader:
    """Guides one participant through a study."""

    def __init__(self, study: Study, folder: Folder, who: str, program: Program) -> None:
        self.study, self.folder, self.who = study, folder, who
        self.program, self.client = program, PageClient(program.port)
        self.state: dict[str, Any] = {}
        self.holder, self.heard = 0, time.monotonic()
        self.profiles: list[str] = []
        self._replies: list[dict[str, Any]] = []
        self.starts = [study.robot.fk(study.robot.home, tool)[:3, 3] for tool in range(study.robot.tool_count)]

    def show(self, **content: Any) -> None:
        """What pages show; docs/reference/protocol.md has its members."""
        self.client.send(type="study", content={"participant": self.who, "title": self.study.title, **content})

    def look(self, seconds: float = 0.05) -> list[dict[str, Any]]:
        """New states; answers and the lease are taken in. Raises Lost."""
        states = []
        for message in self.client.messages(seconds):
            kind = message["type"]
            if kind == "state":
                states.append(message)
                self.state, self.heard = message, time.monotonic()
            elif kind == "welcome":
                self.profiles = [each["name"] for each in message["profiles"]]
            elif kind == "reply":
                self._replies.append(message)
            elif kind == "lease":
                if self.holder and message["holder"] and message["holder"] != self.holder:
                    say(f"  another page (client {message['holder']}) has the arm now; close the page that is not the participant's")
                self.holder = message["holder"]
            elif kind == "error" and message["code"] not in ("code",):
                say(f"  steadyhand: {message['message']}")
        if address := self.program.news():
            say(f"  another page would open {address}")
        return states

    def ask(self, item: Item, place: str) -> int:
        """An answer from the page, inside its range."""
        self._replies.clear()
        self.show(kind="question", key=item.key, text=item.text, low=item.low, high=item.high, low_text=item.low_text, high_text=item.high_text, place=place)
        while True:
            self.look()
            while self._replies:
                reply = self._replies.pop(0)
                content = reply["content"]
                value = content.get("value")
                if content.get("key") != item.key:
                    continue  # the second answer to a question, or an answer from another tab
                if isinstance(value, int) and not isinstance(value, bool) and item.low <= value <= item.high:
                    return value
                say(f"  client {reply['client']} answered {item.key} with {value!r}; it must be from {item.low} to {item.high}")

    def questionnaire(self, condition: str, items: list[Item]) -> None:
        """Those that are not answered yet; each answer is kept at once."""
        done = {row["key"] for row in self.folder.answers(self.who) if row["condition"] == condition}
        for n, item in enumerate(items, 1):
            if item.key not in done:
                self.folder.add_answers(self.who, condition, {item.key: self.ask(item, f"{n} of {len(items)}")})

    def consent(self) -> bool:
        if self.folder.consented(self.who):
            return True
        agreed = self.ask(Item("consent", self.study.consent, 0, 1, "I do not agree", "I agree"), "") == 1
        self.folder.write_consent(self.who, self.study.consent, agreed, time.strftime("%Y-%m-%d"))
        return agreed

    def set_condition(self, condition: Condition) -> None:
        """Raises StudyError if the program does not do so within some seconds."""
        deadline = time.monotonic() + 20.0
        wanted = {"scale": condition.scale, "latency": condition.command_latency}
        while time.monotonic() < deadline:
            self.client.send(type="request", kind="playback", text="")
            for _ in self.look(0.3):
                pass
            self.client.send(type="request", kind="profile", text=condition.profile)
            for kind, value in wanted.items():
                self.client.send(type="request", kind=kind, value=value)
            until = time.monotonic() + 1.0
            while time.monotonic() < until:
                for state in self.look():
                    controls = state["controls"]
                    if self.profiles[controls["profile"]] == condition.profile and all(abs(controls[kind] - value) < 1e-6 for kind, value in wanted.items()):
                        return
        raise StudyError(f"steadyhand does not take condition {condition.name!r}; is the arm still engaged?")

    def _show_goals(self, courses: Courses, text: str, display_latency: float) -> None:
        course, *others = courses.each

        def shown(goal: Goal | None) -> dict[str, Any] | None:
            return None if goal is None else {"p": [round(float(x), 4) for x in goal.p], "radius": goal.radius, "gate": goal.through}

        self.show(kind="task", text=text, goal=shown(course.goal), other_goals=[shown(each.goal) for each in others if each.goal],
                  following=shown(course.following if course.goal and course.goal.through else None),
                  done=len(course.reached), of=len(course.goals), display_latency=display_latency)  # fmt: skip

    def _follow(self, tools: Sequence[int], courses: Courses, text: str, display_latency: float, tracks: Sequence[Track] = ()) -> None:
        """Until the courses of these tools are over. Raises Again if the arm is stopped, or nothing is heard."""
        shown, begin = -1, None
        while not courses.over:
            if len(courses.each[0].reached) != shown:
                shown = len(courses.each[0].reached)
                self._show_goals(courses, text, display_latency)
            for state in self.look(0.02):
                t = state["now_s"]
                begin = t if begin is None else begin
                if state["state"] in ("stopping", "fault") and tracks:
                    raise Again(f"the arm stopped: {state['reason']}")
                for track, tool, course in zip(tracks, tools, courses.each):
                    _append(track, t - begin, state, tool, course.goal)
                courses.take(t, [np.array(state["tools"][tool]["pose"]["p"]) for tool in tools])
            if tracks and time.monotonic() - self.heard > SILENT:
                raise Again("nothing was heard from the arm")

    def trial(self, planned: Planned, condition: Condition, task: Task) -> None:
        text = TEXTS[task.kind] + (" This is a training." if planned.repetition == 0 else "")
        starts = [self.starts[tool] for tool in task.tools]
        start = "Move the glass to the start and hold it there."
        if len(task.tools) > 1:
            text, start = TWO_HANDS + text, "Move both glasses to their starts and hold them there."
        self._follow(task.tools, Courses(_Start(), starts), start, condition.display_latency)
        tracks, courses = [Track() for _ in task.tools], Courses(task, starts)
        self._follow(task.tools, courses, text, condition.display_latency, tracks)
        trial = Trial.of([resampled(track) for track in tracks], courses, [0] * len(tracks))
        rows = [row for row in measure(task, trial.reached, trial, STEP) if row.measure != "submovements"]
        self.folder.write_trial(planned, condition, rows, to_mcap(trial, planned, condition, self.study))


class _Start:
    """The goal before a trial."""

    name, kind, timeout = "start", "start", float("inf")

    def goals(self, start: Any) -> list[Goal]:
        return [Goal(0, np.array(start), START_RADIUS)]

    def hold(self, index: int) -> float:
        return START_HOLD


TEXTS = {
    "targets": "Bring the glass into the ball, hold it until the next one shows, and go on, as fast as you can without missing.",
    "gates": "Move the glass through the rings, one after the other, as fast as you can.",
    "carry": "Carry the glass to the ball and hold it there until the next one shows. Do not spill.",
}


TWO_HANDS = "With both hands at once: the next balls show once both glasses stayed in theirs. "


def _append(track: Track, t: float, state: dict[str, Any], index: int, goal: Goal | None) -> None:
    tool = state["tools"][index]
    track.t.append(t)
    track.hand.append(np.zeros(3))
    track.target.append(np.array(tool["target"]["p"]))
    track.glass.append(np.array(tool["pose"]["p"]))
    track.q.append(np.array(state["q"]))
    track.dq.append(np.array(state["dq"]))
    track.goal.append(-1 if goal is None else goal.index)
    track.held_back.append(state["constraint"]["kind"])
    track.freeboard.append(float(tool["liquid"]["freeboard"] or 0.0))
    # A new engagement fills the glass, but the spill of the trial counts.
    before = track.spilled_share[-1] if track.spilled_share else 0.0
    track.spilled_share.append(max(before, float(tool["liquid"]["spilled_share"])))


def resampled(track: Track) -> Track:
    """Samples every STEP: numbers interpolated linearly between received states, words from the last one."""
    t = np.array(track.t)
    even = np.arange(0.0, t[-1] + 1e-9, STEP)
    last = np.clip(np.searchsorted(t, even + 1e-9) - 1, 0, len(t) - 1)

    def lines(values: list[Any]) -> list[Any]:
        table = np.array(values, dtype=float)
        if table.ndim == 1:
            return np.interp(even, t, table).tolist()
        return list(np.column_stack([np.interp(even, t, column) for column in table.T]))

    return Track(even.tolist(), lines(track.hand), lines(track.target), lines(track.glass), lines(track.q), lines(track.dq),
                 [track.goal[i] for i in last], [track.held_back[i] for i in last], lines(track.freeboard), lines(track.spilled_share))  # fmt: skip


def say(text: str) -> None:
    print(text, flush=True)


def prompt(leader: Leader, text: str) -> str:
    """A line of the experimenter's, while the page's connection is kept. Raises EOFError at the end of the input."""
    print(text, end=" ", flush=True)
    while True:
        leader.look(0.05)
        if select.select([sys.stdin], [], [], 0.0)[0]:
            line = sys.stdin.readline()
            if not line:
                raise EOFError
            return line.strip()


def lead(study: Study, out: Path, port: int) -> int:
    """The next participant who is not done, from where they were. Returns the exit code."""
    files = [c.name for c in study.conditions if "/" in c.profile or "." in c.profile]
    if files:
        raise StudyError(f"{study.path}: condition {files[0]!r} has a profile of a file; with people it must be one that steadyhand has by name")
    only_simulated = [c.name for c in study.conditions if c.profile == ONE_INSTANT_IK]
    if only_simulated:
        raise StudyError(
            f"{study.path}: condition {only_simulated[0]!r} is differential inverse kinematics without collision avoidance, for simulated "
            "operators only: leave it out, or use --simulated"
        )
    late = [c for c in study.conditions if c.command_latency > MOST_LATENCY]
    if late:
        raise StudyError(
            f"{study.path}: condition {late[0].name!r} has a latency of {late[0].latency:g} s on the command path; with people it must be "
            f"{MOST_LATENCY:g} s at most"
        )
    folder = Folder(out)
    folder.hold()
    schedule = schedule_of(study)
    folder.begin(study, schedule, simulated=False)
    items = items_of(study.questionnaires, study.likert)
    for trials in schedule:
        who = trials[0].participant
        left = [each for each in trials if not folder.finished(each)]
        answered = {(row["condition"], row["key"]) for row in folder.answers(who)}
        asked = all((each.condition, item.key) in answered for each in trials for item in items)
        if folder.deleted(who) or not left and asked:
            continue
        say(f"{who}: {len(trials) - len(left)} of {len(trials)} trials are done. Order: " + ", ".join(dict.fromkeys(each.condition for each in trials)))
        first = next(c for c in study.conditions if c.name == trials[0].condition)
        program = Program(study, folder.participant(who) / "sessions", port, first)
        say(f"  the participant's page: {program.address}")
        try:
            if _lead_one(Leader(study, folder, who, program), trials, items):
                say(f"{who} is done. Run the same command again for the next one.")
            return 0
        except Lost as error:
            say(f"{error}. Finished trials are kept: run the same command again to go on")
            return 1
        except EOFError:
            say("\nended. Finished trials are kept: run the same command again to go on")
            return 0
        finally:
            program.end()
    say("all participants are done: ./steadyhand study analyse " + str(out))
    return 0


def _lead_one(leader: Leader, trials: list[Planned], items: list[Item]) -> bool:
    study, folder, who = leader.study, leader.folder, leader.who
    if not leader.consent():
        say(f"{who} does not agree. Nothing was recorded but that; `study delete` removes it.")
        return False
    for period, name in enumerate(dict.fromkeys(each.condition for each in trials), 1):
        condition = next(c for c in study.conditions if c.name == name)
        here = [each for each in trials if each.condition == name]
        for planned in here:
            if folder.finished(planned):
                continue
            task = next(each for each in study.tasks if each.name == planned.task)
            leader.show(kind="text", text=f"Part {period} of {len(study.conditions)}. The next task begins when the experimenter says so.")
            answer = prompt(leader, f"  {planned.number}/{len(trials)} {name}, {planned.task}, {planned.repetition or 'training'}: Enter begins, q ends")
            if answer == "q":
                raise EOFError
            while True:
                try:
                    leader.set_condition(condition)
                    leader.trial(planned, condition, task)
                    break
                except Again as reason:
                    say(f"  done again from its begin: {reason}")
        leader.questionnaire(name, items)
        if period < len(study.conditions) and study.rest and not all(map(folder.finished, trials)):
            _rest(leader, study.rest)
    if "nasa-tlx-weighted" in study.questionnaires:
        leader.questionnaire("", pair_items())
    leader.show(kind="text", text="That was all. Thank you!")
    leader.look(0.5)
    return True


def _rest(leader: Leader, seconds: float) -> None:
    end = time.monotonic() + seconds
    say(f"  a rest of {seconds:g} s")
    shown = -1
    while (left := end - time.monotonic()) > 0.0:
        if int(left) != shown:
            shown = int(left)
            leader.show(kind="text", text=f"Rest for {shown + 1} s.")
        leader.look(0.1)
