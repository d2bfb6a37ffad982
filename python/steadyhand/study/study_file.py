"""STUDY.yaml: what is compared, with what tasks, by how many, in what order, and what is asked. docs/how-to/user-study.md has the keys."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from .. import _native
from .._planner import Pipeline
from .._robot import Robot
from .one_instant_ik import solve
from .order import rows_of
from .questionnaires import Likert, QUESTIONNAIRES
from .tasks import Carry, Gates, Targets, Task
from .trial import ONE_INSTANT_IK, PATHS, Condition


class StudyError(ValueError):
    """What is wrong with a study, and what would be right."""


KINDS: dict[str, type] = {"targets": Targets, "gates": Gates, "carry": Carry}
FACTORS = ("profile", "scale", "latency", "path")
MOST_CONDITIONS, MOST_PARTICIPANTS, MOST_TRIALS = 24, 1000, 100
REACH_TOLERANCE = 0.002  # m, to which a goal must be reached, upright


@dataclass(frozen=True)
class Study:
    name: str
    title: str
    path: Path
    text: str
    """As it was read."""
    robot: Robot
    seed: int
    participants: int
    conditions: tuple[Condition, ...]
    tasks: tuple[Task, ...]
    repetitions: int
    """Trials of each task in each condition, that count."""
    training: int
    """Trials of each task before those."""
    rest: float
    """s between conditions."""
    order: str
    rate: float
    """Hz, of plans in virtual time."""
    consent: str
    questionnaires: tuple[str, ...]
    likert: tuple[Likert, ...]
    reference: str
    """Name of the condition that the others are compared with."""
    factors: tuple[str, ...] = field(default=())


class _Section:
    """A mapping of the file, whose keys are read once each; what is left over is refused."""

    def __init__(self, where: str, value: Any) -> None:
        if not isinstance(value, Mapping):
            raise StudyError(f"{where}: {_shown(value)} is not valid; it must be a mapping of keys to values")
        self.where, self._left = where, dict(value)

    def at(self, key: str) -> str:
        return f"{self.where}: {key}"

    def take(self, key: str, default: Any = None) -> Any:
        return self._left.pop(key, default)

    def need(self, key: str) -> Any:
        if key not in self._left:
            raise StudyError(f"{self.where} has no {key}")
        return self._left.pop(key)

    def text(self, key: str, default: str | None = None) -> str:
        value = self.need(key) if default is None else self.take(key, default)
        if not isinstance(value, str) or not value.strip():
            raise StudyError(f"{self.at(key)} is {_shown(value)}; it must be a text")
        return value

    def number(self, key: str, default: float, low: float, high: float, unit: str = "") -> float:
        return checked(self.at(key), self.take(key, default), low, high, unit)

    def whole(self, key: str, default: int, low: int, high: int) -> int:
        value = self.take(key, default)
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise StudyError(f"{self.at(key)} is {_shown(value)}; it must be a whole number from {low} to {high}")
        return value

    def one_of(self, key: str, default: str, choices: tuple[str, ...]) -> str:
        value = self.take(key, default)
        if value not in choices:
            raise StudyError(f"{self.at(key)} is {_shown(value)}; it must be one of {', '.join(choices)}")
        return value

    def end(self, known: tuple[str, ...]) -> None:
        for key in self._left:
            near = get_close_matches(str(key), known, 1)
            raise StudyError(f"{self.where}: there is no key {key!r}" + (f"; did you mean {near[0]}?" if near else f"; there are {', '.join(known)}"))


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def checked(where: str, value: Any, low: float, high: float, unit: str = "") -> float:
    unit = f" {unit}" if unit else ""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value) or not low <= value <= high:
        raise StudyError(f"{where} is {_shown(value)}; it must be a number from {low:g} to {high:g}{unit}")
    return float(value)


def _point(where: str, value: Any) -> tuple[float, float, float]:
    if not isinstance(value, list) or len(value) != 3:
        raise StudyError(f"{where} is {_shown(value)}; it must be three numbers: x, y, z from the glass's home position, m")
    x, y, z = (checked(where, each, -3.0, 3.0, "m") for each in value)
    return x, y, z


def _list(section: _Section, key: str, least: int = 1) -> list[Any]:
    value = section.need(key)
    if not isinstance(value, list) or len(value) < least:
        raise StudyError(f"{section.at(key)} is {_shown(value)}; it must be a list of {least} or more")
    return value


def _name(section: _Section, default: str | None = None) -> str:
    name = section.text("name", default)
    if not all(c.isalnum() or c in "-_+. " for c in name) or len(name) > 40 or name != name.strip() or name.startswith("."):
        raise StudyError(f"{section.at('name')} is {name!r}; names have letters, digits, spaces, - _ + . and 40 characters at most")
    return name


def _tools(section: _Section, robot: Robot) -> tuple[int, ...]:
    """Indices of the tools that a task names, one for each hand."""
    names = section.take("tools", [robot.tool_names[0]])
    has = f"{robot.name} has {', '.join(robot.tool_names)}"
    if not isinstance(names, list) or not 1 <= len(names) <= 2 or len(set(map(str, names))) != len(names):
        raise StudyError(f"{section.at('tools')} is {_shown(names)}; it must be a list of one or two tools, each once: {has}")
    if len(names) > robot.tool_count:
        raise StudyError(f"{section.at('tools')} is {_shown(names)}; a task for two hands takes a robot with two tools, such as two_ur5e: {has}")
    for i, name in enumerate(names):
        if name not in robot.tool_names:
            raise StudyError(f"{section.at(f'tools[{i}]')} is {_shown(name)}; it must be a tool of the robot: {has}")
    return tuple(robot.tool_names.index(name) for name in names)


def _task(where: str, value: Any, robot: Robot) -> Task:
    section = _Section(where, value)
    kind = section.one_of("kind", "", tuple(KINDS))
    name = _name(section, kind)
    timeout = section.number("timeout", 10.0, 1.0, 600.0, "s")
    if kind == "targets":
        plane = section.one_of("plane", "yz", ("xy", "xz", "yz"))
        distance = checked(section.at("distance"), section.need("distance"), 0.02, 2.0, "m")
        width = checked(section.at("width"), section.need("width"), 0.002, distance, "m, the distance at most")
        count = section.whole("count", 9, 3, 49)
        if count % 2 == 0:
            raise StudyError(f"{section.at('count')} is {count}; it must be odd, so that each reach goes across the circle")
        task: Task = Targets(name, distance, width, count, section.number("dwell", 0.3, 0.05, 5.0, "s"), plane, timeout,
                             _tools(section, robot))  # fmt: skip
    elif kind == "gates":
        gates = tuple(_point(f"{where}: gates[{i}]", each) for i, each in enumerate(_list(section, "gates", 2)))
        task = Gates(name, gates, section.number("radius", 0.04, 0.005, 0.5, "m"), timeout)
    else:
        places = tuple(_point(f"{where}: places[{i}]", each) for i, each in enumerate(_list(section, "places")))
        task = Carry(name, places, section.number("radius", 0.02, 0.002, 0.5, "m"), section.number("holding", 1.0, 0.05, 60.0, "s"), timeout)
    section.end(("kind", *(each.name for each in fields(KINDS[kind]))))
    return task


def _condition(where: str, value: Any, defaults: Mapping[str, Any], levels: tuple[tuple[str, str], ...] = ()) -> Condition:
    section = _Section(where, {**defaults, **value} if isinstance(value, Mapping) else value)
    profile = section.text("profile", "tracking")
    scale = section.number("scale", 0.5, 0.05, 5.0)
    latency = section.number("latency", 0.0, 0.0, 2.0, "s")
    path = section.one_of("path", "command", PATHS)
    name = _name(section, " ".join(level for _, level in levels) or profile)
    section.end(("name", *FACTORS))
    return Condition(name, profile, scale, latency, path, levels)


def level_text(factor: str, value: Any) -> str:
    return f"{1e3 * value:.0f} ms" if factor == "latency" and isinstance(value, (int, float)) else str(value)


def _conditions(top: _Section, file: str) -> tuple[tuple[Condition, ...], tuple[str, ...]]:
    defaults = top.take("defaults", {})
    allowed = _Section(f"{file}: defaults", defaults)
    for key in FACTORS:
        allowed.take(key)
    allowed.end(FACTORS)
    factors, listed = top.take("factors"), top.take("conditions")
    if (factors is None) == (listed is None):
        raise StudyError(f"{file} must have conditions, a list, or factors, whose combinations are the conditions; one of both")
    if listed is not None:
        if not isinstance(listed, list) or not listed:
            raise StudyError(f"{file}: conditions is {_shown(listed)}; it must be a list of one or more")
        return tuple(_condition(f"{file}: conditions[{i}]", each, defaults) for i, each in enumerate(listed)), ()
    names = tuple(_Section(f"{file}: factors", factors)._left)
    for name in names:
        if name not in FACTORS:
            raise StudyError(f"{file}: factors: there is no factor {name!r}; there are {', '.join(FACTORS)}")
        if not isinstance(factors[name], list) or not factors[name] or len(set(map(str, factors[name]))) != len(factors[name]):
            raise StudyError(f"{file}: factors: {name} is {_shown(factors[name])}; it must be a list of levels, each once")
    found = []
    for combination in itertools.product(*(factors[name] for name in names)):
        levels = tuple((name, level_text(name, value)) for name, value in zip(names, combination))
        found.append(_condition(f"{file}: factors", dict(zip(names, combination)), defaults, levels))
    return tuple(found), names


KEYS = ("name", "title", "robot", "seed", "participants", "defaults", "conditions", "factors", "tasks", "repetitions", "training", "rest",
        "order", "rate", "consent", "questionnaires", "likert", "reference")  # fmt: skip


def load_study(path: str | Path, participants: int | None = None) -> Study:
    """The study of a file; participants: in place of the file's. Raises StudyError with the file, the key, the value and what would be
    right, also for what would fail only with a participant in the room: unknown profiles, places out of the arm's reach, an order that
    cannot be balanced.
    """
    path = Path(path)
    file = str(path)
    try:
        text = path.read_text(encoding="utf-8")
        content = yaml.safe_load(text)
    except FileNotFoundError:
        raise StudyError(f"{file}: there is no such file") from None
    except OSError as error:
        raise StudyError(f"{file} cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise StudyError(f"{file} is no text in UTF-8") from None
    except yaml.YAMLError as error:
        raise StudyError(f"{file} is no YAML: {' '.join(str(error).split())}") from None
    top = _Section(file, content)
    name = _name(top)
    title = top.text("title", name)
    robot_name = top.text("robot", "ur5e")
    try:
        robot = Robot(robot_name)
    except (ValueError, FileNotFoundError) as error:
        raise StudyError(f"{file}: robot: {error}") from None
    seed = top.whole("seed", 1, 0, 2**31)
    number = top.whole("participants", 24, 1, MOST_PARTICIPANTS)
    if participants is not None:
        number = participants
    conditions, factors = _conditions(top, file)
    tasks = tuple(_task(f"{file}: tasks[{i}]", each, robot) for i, each in enumerate(_list(top, "tasks")))
    repetitions = top.whole("repetitions", 2, 1, MOST_TRIALS)
    training = top.whole("training", 1, 0, MOST_TRIALS)
    rest = top.number("rest", 60.0, 0.0, 3600.0, "s")
    order = top.one_of("order", "balanced", ("balanced", "random"))
    rate = top.number("rate", 50.0, 5.0, 500.0, "Hz")
    consent = top.text("consent", "I take part of my own free will and may stop at any time, without saying why.")
    asked = top.take("questionnaires", [])
    if not isinstance(asked, list) or any(each not in QUESTIONNAIRES for each in asked):
        raise StudyError(f"{file}: questionnaires is {_shown(asked)}; it must be a list of some of {', '.join(QUESTIONNAIRES)}")
    likert = _likert(top.take("likert", []), f"{file}: likert")
    reference = top.text("reference", conditions[0].name)
    top.end(KEYS)

    _unique(f"{file}: conditions", [each.name for each in conditions])
    _unique(f"{file}: tasks", [each.name for each in tasks])
    if len(conditions) > MOST_CONDITIONS:
        raise StudyError(f"{file} has {len(conditions)} conditions; {MOST_CONDITIONS} are the most")
    if reference not in [each.name for each in conditions]:
        raise StudyError(f"{file}: reference is {reference!r}; it must be one of the conditions: {', '.join(c.name for c in conditions)}")
    rows = rows_of(len(conditions))
    if order == "balanced" and number % rows:
        near = [str(each) for each in (number // rows * rows, (number // rows + 1) * rows) if each]
        raise StudyError(
            f"{file}: the order of {len(conditions)} conditions cannot be balanced over {number} participants: it takes a multiple of {rows}, "
            f"so {' or '.join(near)}, or order: random"
        )
    study = Study(name, title, path, text, robot, seed, number, conditions, tasks, repetitions, training, rest, order, rate, consent,
                  tuple(asked), likert, reference, factors)  # fmt: skip
    _check_profiles(study)
    _check_reach(study)
    return study


def _likert(value: Any, where: str) -> tuple[Likert, ...]:
    if not isinstance(value, list):
        raise StudyError(f"{where} is {_shown(value)}; it must be a list of statements")
    found = []
    for i, each in enumerate(value):
        section = _Section(f"{where}[{i}]", {"statement": each} if isinstance(each, str) else each)
        statement = section.text("statement")
        found.append(Likert(_name(section, f"likert {i + 1}"), statement, section.whole("points", 7, 2, 11)))
        section.end(("name", "statement", "points"))
    _unique(where, [each.name for each in found])
    return tuple(found)


def _unique(where: str, names: list[str]) -> None:
    for name in names:
        if sum(_file_name(name) == _file_name(other) for other in names) > 1:
            raise StudyError(f"{where}: the name {name!r} occurs twice; give each its own name")


def _file_name(name: str) -> str:
    return name.replace(" ", "-").lower()


def _check_profiles(study: Study) -> None:
    for condition in study.conditions:
        if condition.profile == ONE_INSTANT_IK:
            continue
        try:
            Pipeline(study.robot, condition.profile, scale=condition.scale)
        except (ValueError, FileNotFoundError) as error:
            known = ", ".join([*_native.names_in("profiles"), ONE_INSTANT_IK])
            raise StudyError(f"{study.path}: condition {condition.name!r}: {error}. A condition's profile is one of {known}, or a file") from None


def _check_reach(study: Study) -> None:
    """Every goal can be held, with the glass upright and nothing touching."""
    robot = study.robot
    home = np.array([robot.fk(robot.home, tool) for tool in range(robot.tool_count)])
    for task in study.tasks:
        for goals in zip(*(task.goals(home[tool, :3, 3]) for tool in task.tools)):
            wanted = home.copy()
            for tool, goal in zip(task.tools, goals):
                wanted[tool, :3, 3] = goal.p
            T, way = home.copy(), wanted[:, :3, 3] - home[:, :3, 3]
            # In small steps, as the arm would go there.
            q = robot.home
            for share in np.linspace(0.1, 1.0, 10):
                T[:, :3, 3] = home[:, :3, 3] + share * way
                q = solve(robot, T, q, iterations=100)
            away = max(float(np.linalg.norm(robot.fk(q, tool)[:3, 3] - wanted[tool, :3, 3])) for tool in task.tools)
            place = f"{study.path}: task {task.name!r}: goal {goals[0].index} at {np.round(way[task.tools[0]], 3).tolist()} m from home"
            if away > REACH_TOLERANCE:
                raise StudyError(f"{place} is out of the arm's reach: the tool reaches {1e3 * away:.0f} mm of it; move it nearer to home")
            if robot.clearance(q) < 0.0:
                raise StudyError(f"{place} cannot be held: parts of the arm would touch there; move it")
