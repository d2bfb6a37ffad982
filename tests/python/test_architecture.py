"""The figure of HACKING.md (docs/pictures/architecture.svg) shows the modules, parts and structs that there are."""

import importlib.util
import os
import re
from pathlib import Path

ROOT = Path(os.environ.get("STEADYHAND_ROOT", Path(__file__).resolve().parents[2]))
spec = importlib.util.spec_from_file_location("architecture", ROOT / "docs/pictures/architecture.py")
figure = importlib.util.module_from_spec(spec)
spec.loader.exec_module(figure)


def test_the_figure_is_what_its_script_draws_of_the_modules():
    drawn = (ROOT / "docs/pictures/architecture.svg").read_text()
    assert drawn == figure.draw(), "run python3 docs/pictures/architecture.py"


def test_every_folder_is_a_part_or_a_module():
    source = ROOT / "src/steadyhand"
    parts = figure.read_parts()
    modules = {path.name for path in source.iterdir() if path.is_dir()}
    assert modules == set(figure.read_modules(parts)) and len(modules) == 10
    assert {f"{m}/{p.name}" for m in modules - {"core"} for p in (source / m).iterdir() if p.is_dir()} == set(parts) - {"core"}


def test_the_flow_names_parts_and_structs():
    names = {name for path in figure.read_parts() for name in path.split("/")}
    assert {part for words in figure.FLOW for part in re.findall(r"[\w]+", words[0])} <= names
    arrows = (ROOT / "src/steadyhand/core/arrows.hpp").read_text()
    assert all(f"struct {name} {{" in arrows for name in [*figure.STRUCTS, "JointState"])


def test_what_follows_from_other_lines_is_not_drawn():
    assert set(figure.edges({"a": [], "b": ["a"], "c": ["a", "b"]})) == {("b", "a"), ("c", "b")}


def test_no_two_headers_have_one_name():
    names = [path.name for path in (ROOT / "src").rglob("*.hpp")]
    assert sorted(name for name in set(names) if names.count(name) > 1) == []
