"""The figure of HACKING.md (docs/pictures/architecture.svg) shows the rooms, libraries and structs that there are."""

import importlib.util
import os
import re
from pathlib import Path

ROOT = Path(os.environ.get("STEADYHAND_ROOT", Path(__file__).resolve().parents[2]))
spec = importlib.util.spec_from_file_location("architecture", ROOT / "docs/pictures/architecture.py")
figure = importlib.util.module_from_spec(spec)
spec.loader.exec_module(figure)


def test_the_figure_is_what_its_script_draws_of_the_rooms():
    drawn = (ROOT / "docs/pictures/architecture.svg").read_text()
    assert drawn == figure.draw(), "run python3 docs/pictures/architecture.py"


def test_every_room_stands_in_its_library_below_what_it_uses():
    uses, libraries = figure.read_uses(), figure.read_libraries()
    folders = {path.name for path in (ROOT / "src/steadyhand").iterdir() if path.is_dir()}
    placed = {room: name for name, (*_, rooms) in figure.LIBRARIES.items() for room in rooms}
    assert set(uses) == folders == set(placed)
    assert {room: name for room, name in placed.items() if name in ("planning", "live")} == libraries
    for room, used in figure.edges(uses):
        assert figure.centre(room)[1] > figure.centre(used)[1] or room == "python", f"{room} stands above {used}"


def test_the_flow_names_rooms_and_structs():
    assert {room for words in figure.FLOW for room in re.findall(r"[\w]+", words[0])} <= set(figure.read_uses())
    arrows = (ROOT / "src/steadyhand/core/arrows.hpp").read_text()
    assert all(f"struct {name} {{" in arrows for name in [*figure.STRUCTS, "JointState"])


def test_what_follows_from_other_lines_is_not_drawn():
    assert set(figure.edges({"a": [], "b": ["a"], "c": ["a", "b"]})) == {("b", "a"), ("c", "b")}
