"""No #include points up, and the figure and table of HACKING.md show the modules, parts and structs that there are."""

import graphlib
import importlib.util
import re

import pytest

from places import ROOT

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


def test_no_two_types_have_one_name():
    """All are in namespace steadyhand: of two definitions of one name the linker would take either."""
    texts = [path.read_text() for path in (ROOT / "src").rglob("*.hpp")]
    names = [name for text in texts for name in re.findall(r"^(?:struct|class|enum class) (\w+)(?= (?:final )?(?:: [^{;]*)?\{)", text, re.MULTILINE)]
    assert len(names) > 400 and sorted(name for name in set(names) if names.count(name) > 1) == []


def test_no_two_headers_have_one_name():
    names = [path.name for path in (ROOT / "src").rglob("*.hpp")]
    assert sorted(name for name in set(names) if names.count(name) > 1) == []


def includes_of(file):
    return re.findall(r'^\s*#\s*include\s*"([^"]+)"', file.read_text(), re.MULTILINE)


def part_of(path):
    """`core` or `MODULE/PART`; of a facade its module. None for a path that does not begin with `steadyhand/`."""
    root, *folders = path.removesuffix(".hpp").split("/")
    return None if root != "steadyhand" else "core" if folders[0] == "core" else "/".join(folders[:2])


def violations(uses, includes):
    """Of (file, header): a facade includes its module alone; a part what it names, and what these name; two parts all."""
    for file, header in includes:
        part, used = part_of(file), part_of(header)
        if part in uses:
            allowed = uses if part in ("apps/commands", "apps/python") else {part, *figure.all_used(uses, part)}
        else:
            allowed = {path for path in uses if path.startswith(f"{part}/")}
        if used not in allowed:
            yield f"{file} includes {header}"


def test_no_include_points_up():
    """All of src/ is one include root, so the compiler would not notice a header of another part."""
    uses = figure.read_parts()
    src = ROOT / "src"
    includes = [(str(file.relative_to(src)), header) for file in src.rglob("*.[ch]pp") for header in includes_of(file)]
    assert len(includes) > 1000 and list(violations(uses, includes)) == []
    graphlib.TopologicalSorter(figure.read_modules(uses)).prepare()  # raises if modules use each other in a circle


def test_an_include_that_points_up_is_seen(tmp_path):
    uses = {"core": [], "geometry/robot": ["core"], "files/input": ["core"], "planning/plan": ["geometry/robot"], "apps/commands": []}
    fine = [("planning/plan/a.hpp", "core/time.hpp"), ("planning/plan/inner/a.cpp", "planning/plan/a.hpp"),
            ("apps/commands/main.cpp", "planning/plan/a.hpp"), ("planning.hpp", "planning/plan/a.hpp")]  # fmt: skip
    bad = [("geometry/robot/model.cpp", "planning/plan/a.hpp"), ("core/time.hpp", "apps/commands/options.hpp"),
           ("planning/plan/a.cpp", "files/input/recording.hpp"), ("attic/box/a.cpp", "core/time.hpp"),
           ("planning.hpp", "geometry/robot/model.hpp")]  # fmt: skip
    assert list(violations(uses, [(f"steadyhand/{file}", f"steadyhand/{header}") for file, header in fine])) == []
    for file, header in bad:
        assert list(violations(uses, [(f"steadyhand/{file}", f"steadyhand/{header}")])), file
    assert list(violations(uses, [("steadyhand/planning/plan/a.cpp", "plan/a.hpp")]))
    (tmp_path / "a.hpp").write_text('#include <vector>\n  # include "steadyhand/planning/plan/b.hpp"\n// "x/y.hpp"\n')
    assert includes_of(tmp_path / "a.hpp") == ["steadyhand/planning/plan/b.hpp"]
    with pytest.raises(graphlib.CycleError):
        graphlib.TopologicalSorter(figure.read_modules({"a/one": [], "b/two": ["a/one"], "a/three": ["b/two"]})).prepare()


def test_hacking_has_a_row_for_each_module_that_names_its_parts():
    rows = dict(re.findall(r"^\| `(\w+)` \|(.*)$", (ROOT / "HACKING.md").read_text(), re.MULTILINE))
    for path in figure.read_parts():
        assert f"`{path.split('/')[-1]}`" in rows[path.split("/")[0]], path
