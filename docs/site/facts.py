"""Tables of the site, from the program and the repository: `<!-- facts: NAME -->` in a page becomes what NAME() returns, Markdown."""

import functools
import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[2]
PYTHON_COMMANDS = ("dataset", "policy", "score", "study")


def run(*command, **environment):
    program = os.environ.get("STEADYHAND_PROGRAM", str(ROOT / "build/release/steadyhand"))
    module = ["-m", "steadyhand", command[0]] if command[0] == "policy" else ["-m", f"steadyhand.{command[0]}"]
    whole = [sys.executable, *module, *command[1:]] if command[0] in PYTHON_COMMANDS else [program, *command]
    environment = os.environ | {"COLUMNS": "1000", "PYTHONPATH": str(ROOT / "build/release/python"), "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"} | environment
    done = subprocess.run(whole, capture_output=True, text=True, env=environment, cwd=ROOT)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(whole)} failed: {done.stderr}")
    return done.stdout


def cell(text):
    """Without what Markdown or a table would take for its own."""
    return re.sub(r"docs/([\w-]+/)([\w-]+)\.md", r"[\2](../\1\2.md)", re.sub(r"([|<\[*_])", r"\\\1", text))


def table(head, rows):
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *rows)) + "\n"


def demo():
    """Where the site is published with the demo next to it (.github/workflows/site.yml)."""
    return '<a href="demo/index.html">Open the demo</a>, ' if os.environ.get("STEADYHAND_DEMO") else ""


def settings():
    """Sections and rows as `steadyhand config` prints them."""
    rows, out, section = [], [], ""
    for line in [*run("config", HOME="~", XDG_DATA_HOME="").splitlines()[1:], "end:"]:
        key, value, meaning = re.fullmatch(r" *(\w+): ?(.*?) *(?:# (.*?) \[default\])?", line).groups()
        if meaning is None or key == "end":
            out += ([f"## {section}"] if section else []) + [table(["setting", "default", "meaning"], rows)]
            section, rows = key, []
        else:
            rows.append([f"`{section}.{key}`".replace("`.", "`"), f"`{value}`", cell(meaning)])
    return "\n".join(out)


def options(text):
    """Help as Markdown: options and arguments in tables."""
    out, rows = [], []
    for line in [*text.splitlines(), ""]:
        text = line.strip()
        code = text.lower().startswith(("usage: ", "./steadyhand ", "steadyhand "))
        option = re.fullmatch(r" +(\S+(?: \S+)*)(?:  +(\S.*))?", line)
        if rows and len(line) - len(text) > 16:
            rows[-1][1] += cell(text)
        elif option and not code:
            rows.append([f"`{option[1]}`", cell(option[2] or "")])
        else:
            out += [table(["option", "meaning"], rows)] if rows else []
            rows = []
            shown = f"**{text[:-1]}**" if text.endswith(":") else cell(text)
            out += [f"    {re.sub('^[Uu]sage: ', '', text)}"] if code else ["", shown, ""]
    return "\n".join(out)


def commands():
    """Each command's help."""
    script = re.findall(r"^#   \./steadyhand (.{20}) (.*)$", (ROOT / "steadyhand").read_text(), re.MULTILINE)
    own = re.findall(r"^  ([\w-]+) +\S", run("--help").split("Subcommands:")[1].split("Examples:")[0], re.MULTILINE)
    rows = [[f"`./steadyhand {usage.strip()}`", cell(what)] for usage, what in script]
    return "\n".join([table(["command", "meaning"], rows), *(f"## {name}\n\n{options(run(name, '--help'))}\n" for name in sorted([*own, *PYTHON_COMMANDS]))])


def robots():
    out = []
    for path in sorted((ROOT / "robots").glob("*.yaml")):
        robot, source = json.loads(run("describe", path.stem)), yaml.safe_load(path.read_text())
        comment = " ".join(line[2:] for line in re.split(r"\n#?\n", path.read_text())[0].splitlines() if line.startswith("# "))
        rows = [[f"`{joint['name']}`", joint["type"], *(f"{robot[key][i]:.4g}" for key in ("position_min", "position_max", "velocity_max", "acceleration_max"))]
                for i, joint in enumerate(robot["joints"])]  # fmt: skip
        urdf = source.get("urdf", {})
        package = f"URDF: PyPI package `{urdf['distribution']}`." if "distribution" in urdf else f"Extends `{source['extends']}`." if "extends" in source else ""
        out += [f"### {path.stem}", f"{comment} {package} {len(robot['bodies'])} bodies, {len(robot['pairs'])} pairs.\n",
                table(["joint", "type", "position from", "to", "velocity", "acceleration"], rows)]  # fmt: skip
    return "\n".join(out)


def profiles():
    """A column for each profile."""
    files = {path.stem: yaml.safe_load(path.read_text()) for path in sorted((ROOT / "profiles").glob("*.yaml"))}
    flat = {name: {f"{key}.{inner}" if inner else key: each for key, value in keys.items() if key not in ("name", "label")
                   for inner, each in (value.items() if isinstance(value, dict) else [("", value)])} for name, keys in files.items()}  # fmt: skip
    rows = [[f"`{key}`", *(str(keys.get(key, "")) for keys in flat.values())] for key in dict.fromkeys(key for keys in flat.values() for key in keys)]
    return table(["key", *(f"`{name}`" for name in flat)], rows)


def cells():
    objects = {path.stem: yaml.safe_load(path.read_text())["objects"] for path in sorted((ROOT / "cells").glob("*.yaml"))}
    return table(["cell", "objects"], [[f"`{name}`", ", ".join(each["name"] for each in all_objects)] for name, all_objects in objects.items()])


def tasks():
    files = {path.stem: yaml.safe_load(path.read_text()) for path in sorted((ROOT / "tasks").glob("*.yaml"))}
    return table(["task", "instruction", "robot", "time limit, s"], [[f"`{name}`", task["instruction"], f"`{task.get('robot', 'any')}`", str(task.get("time_limit", 60))]
                                                                    for name, task in files.items()])  # fmt: skip


@functools.cache
def recorded():
    """Channels of a recording that the program writes now, by topic, and the features of the data set that is made of it."""
    from mcap.reader import make_reader

    with tempfile.TemporaryDirectory() as folder:
        run("tasks", "carry", "--episodes", "1", "--profiles", "carry", "--sessions", f"{folder}/sessions")
        with next(Path(folder, "sessions").glob("*.mcap")).open("rb") as file:
            summary = make_reader(file).get_summary()
        run("dataset", f"{folder}/sessions", "--out", f"{folder}/data")
        info = json.loads(Path(folder, "data/meta/info.json").read_text())
    return {channel.topic: summary.schemas[channel.schema_id] for channel in summary.channels.values()}, info["features"]


def members(properties, prefix=""):
    """Rows of a JSON schema; times, poses and vectors are one."""
    for name, each in properties.items():
        inner, item = each.get("properties", {}), each.get("items", {})
        kind = "time" if "nsec" in inner else "pose" if "orientation" in inner else "list of " + item.get("type", "any") if item else each.get("type", "any")
        kind = "list of pose" if "orientation" in item.get("properties", {}) else kind
        yield [f"`{prefix}{name}`", kind, cell(each.get("description", ""))]
        if kind == "object":
            yield from members(inner, f"{prefix}{name}.")
        elif kind == "list of object":
            yield from members(item.get("properties", {}), f"{prefix}{name}[].")


def topics():
    channels, by_schema = recorded()[0], {}
    for topic, schema in sorted(channels.items()):
        by_schema.setdefault(schema.name, (schema, []))[1].append(topic)
    out = []
    for name, (schema, names) in sorted(by_schema.items(), key=lambda each: each[1][1]):
        described = json.loads(schema.data)
        out += [f"### {', '.join(names)}\n", f"Schema `{name}`. {cell(described.get('description', ''))}.\n", table(["member", "type", "meaning"], members(described["properties"]))]
    return "\n".join(out)


def protocol(side):
    """JSON schemas of the messages that "client" or "server" sends, by type."""
    messages = json.loads((ROOT / "web/protocol/schema.json").read_text())["definitions"][side]["anyOf"]
    return {each.get("anyOf", [each])[0]["properties"]["type"]["const"]: each for each in messages}


def named(schema):
    """Members that are not constant: the name, `?` if it may be absent, `[]` if it is a list, and the unit; the meaning; the schema."""
    for name, each in schema["properties"].items():
        if "const" not in each:
            size = each["minItems"] if each.get("minItems") == each.get("maxItems", 0) else ""
            what, unit = re.fullmatch(r"(.*?)(?:(?:, |^)((?:m|s|us|rad|Hz)(?:/s(?:\^2)?)?))?", each.get("description", "")).groups()
            yield f"`{name}`{'?' * (name not in schema['required'])}{f'[{size}]' * ('items' in each)}{f' ({unit})' * bool(unit)}", what, each


def in_a_row(members):
    return "; ".join(" ".join(filter(None, [name, what, inside(each)])) for name, what, each in members)


def inside(schema):
    """Members of an object or of a list's objects: first those that all its cases have."""
    cases = [each for each in schema.get("anyOf", [schema]) if "properties" in each]
    if not cases:
        return inside(schema["items"]) if "items" in schema else ""
    common = [each for each in named(cases[0]) if all(each in named(case) for case in cases)]
    parts = [in_a_row(common)]
    for case in cases if len(cases) > 1 else []:
        value = next(each["const"] for each in case["properties"].values() if "const" in each)
        parts.append(f"of `{value}`: {in_a_row(each for each in named(case) if each not in common)}")
    return f"{{ {'; '.join(parts)} }}"


def messages(side):
    apart = ("state", "request")
    return table(["type", "members", ""], [[f"`{name}`", "see below" if name in apart else in_a_row(named(each)), each.get("description", "")] for name, each in protocol(side).items()])


def client_messages():
    return messages("client")


def server_messages():
    return messages("server")


def requests():
    cases = protocol("client")["request"]["anyOf"]
    return table(["request", "members", ""], [[f"`{each['properties']['kind']['const']}`", in_a_row(named(each)), each["description"]] for each in cases])


def state():
    def rows(schema, prefix=""):
        for name, what, each in named(schema):
            yield [f"`{prefix}{name[1:]}", what]
            inner = each.get("items", each)
            yield from rows(inner, f"{prefix}{name.split('`')[1]}{'[]' * ('items' in each)}.") if "properties" in inner else []

    return table(["member", "meaning"], rows(protocol("server")["state"]))


def features():
    rows = []
    for name, feature in recorded()[1].items():
        names = feature["names"] or []
        rows.append([f"`{name}`", feature["dtype"], str(feature["shape"][0]), ", ".join(f"`{each}`" for each in names[:14]) + (", …" if len(names) > 14 else "")])
    return table(["feature", "type", "entries", "names"], rows)


def cpp():
    """The first page of Doxygen's, whose names are links."""
    text = (ROOT / "docs/doxygen/main.md").read_text().split("\n", 1)[1]
    made = {path.name for path in (ROOT / "build/doxygen/html").glob("*.html")}

    def link(found):
        page = next((each for kind in ("class", "struct") if (each := f"{kind}steadyhand_1_1{found[1]}.html") in made), "namespacesteadyhand.html")
        return f"[`steadyhand::{found[1]}`](../cpp/{page})"

    text = re.sub(r"`docs/([\w-]+/)([\w-]+)\.md`", r"[\2](../\1\2.md)", text).replace("`CONVENTIONS.md`", "[conventions](../project/CONVENTIONS.md)")
    text += "\n[All classes](../cpp/annotated.html)\n"
    return "".join(part if i % 2 else re.sub(r"steadyhand::(\w+)", link, part) for i, part in enumerate(re.split(r"(`.*?`)", text)))
