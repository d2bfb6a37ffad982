"""A term's name stands in its own file and nowhere else in the program or its page, so that a term can be added, or renamed, by
touching one file. Profiles, docs and tests may name terms."""

import re

from places import ROOT

TERMS = "src/steadyhand/planning/ocp"
# Other things of the same name, by file.
OTHERS = {
    # what holds the arm back: kinds of limits, of the constraint's and the arm's, in recordings and the protocol
    "src/steadyhand/planning/plan/active_constraint.hpp": {"position", "velocity", "acceleration", "self_collision"},
    "src/steadyhand/report/figures/session_story.cpp": {"position", "velocity", "acceleration", "self_collision"},
    "web/src/protocol.ts": {"position", "velocity", "acceleration", "self_collision"},
    "web/src/descriptions.ts": {"velocity"},
    "web/src/session.ts": {"position", "velocity", "acceleration", "self_collision"},
    "web/src/scene/stage.ts": {"self_collision"},
    "web/src/input/sides.ts": {"position", "velocity", "acceleration"},
    "web/protocol/schema.json": {"no_spill", "position", "velocity", "acceleration", "self_collision", "lateral"},
    # the term whose pull the planner bounds, the rows that it fills, keys of problems and their obstacles
    "src/steadyhand/planning/plan/planner.cpp": {"position"},
    "src/steadyhand/planning/plan/obstacle_rows.cpp": {"obstacles"},
    "src/steadyhand/files/record/problem_json.cpp": {"lean", "acceleration_step", "relative_pose", "obstacles", "velocity"},
    "src/steadyhand/files/record/model_json.cpp": {"velocity"},
    "src/steadyhand/files/record/model_json.hpp": {"velocity"},
    "src/steadyhand/operator/protocol/operator.hpp": {"no_spill"},
    "src/steadyhand/operator/protocol/requests.hpp": {"velocity"},
    "src/steadyhand/session/live/describe_snapshot.hpp": {"lateral"},
    # attributes of a reference and a plan in Python
    "src/steadyhand/apps/python/stages.cpp": {"velocity"},
    "src/steadyhand/core/describe.hpp": {"position"},
    # members of a pose, Foxglove's and A-Frame's, the speed of a scene's things, and the force on the liquid
    "src/steadyhand/files/record/message_style.hpp": {"position", "orientation"},
    "src/steadyhand/files/record/messages.hpp": {"no_spill", "velocity", "lateral"},
    "src/steadyhand/files/input/recording.hpp": {"position"},
    "src/steadyhand/files/input/aframe.cpp": {"position"},
    # a key of cuRobo's spheres
    "src/steadyhand/files/config/curobo_world.cpp": {"position"},
    # curves of the measured acceleration
    "src/steadyhand/report/figures/page_data.cpp": {"lateral", "vertical"},
    "src/steadyhand/report/figures/motion.cpp": {"lateral"},
    "web/report.html": {"lateral", "vertical"},
    "web/src/report/data.ts": {"lateral", "vertical"},
    "web/src/report/plots.ts": {"lateral", "vertical"},
    "web/src/plots/plots.ts": {"lateral"},
    "web/src/style.css": {"lateral"},
    # the one weight that the menu of a headset has
    "web/src/input/menu.ts": {"lateral"},
    # keys of a liquid, and which terms a profile has without naming them
    "src/steadyhand/files/config/profile_file.cpp": {"lean"},
    "src/steadyhand/planning/liquid/liquid.hpp": {"no_spill"},
    "src/steadyhand/planning/ocp/ocp.cpp": {"posture"},
    "src/steadyhand/planning/ocp/ocp.hpp": {"posture"},
    # an attribute of a mesh
    "web/src/scene/ribbon.ts": {"position"},
    "web/src/scene/surroundings.ts": {"position"},
    "web/src/input/handles.ts": {"position"},
    "web/src/scene/glass.ts": {"position"},
}


def terms_of(root):
    """Name of each term, and its own file."""
    files = [*(root / TERMS).glob("objective_*.cpp"), *(root / TERMS).glob("constraint_*.cpp")]
    found = [(name, str(file.relative_to(root))) for file in files
             for name in re.findall(r'\.name = "(\w+)"|Constraint(?:For\(|Info)\{"(\w+)"', file.read_text())]  # fmt: skip
    # A session's state is called `stopping`, too.
    return {objective or constraint: file for (objective, constraint), file in found if constraint != "stopping"}


def mentions(root, terms):
    """(file, name): as a whole string, as a selector, or in `NAME_weight` and `objective_NAME`."""
    files = [file for folder in ("src", "web/src", "web/protocol") for file in (root / folder).rglob("*.*")]
    for file in [*files, root / "web/index.html", root / "web/report.html"]:
        if file.suffix in (".hpp", ".cpp", ".js", ".ts", ".html", ".css", ".json") and "fixtures" not in file.parts and file.exists():
            text = file.read_text()
            for name in terms:
                if name in text and re.search(f"[\"'`#]{name}[\"'`]|\\b{name}_weight|[\"'`.]objective_{name}\\b", text):
                    yield str(file.relative_to(root)), name


def test_a_terms_name_stands_in_its_own_file():
    terms = terms_of(ROOT)
    assert len(terms) >= 16, sorted(terms)
    found = set(mentions(ROOT, terms))
    assert found == {(file, name) for name, file in terms.items()} | {(file, name) for file in OTHERS for name in OTHERS[file]}, "take it from Objective::info()"


def test_names_are_found_wherever_they_stand(tmp_path):
    named = {
        f"{TERMS}/objective_lateral.cpp": '.name = "lateral"', "src/steadyhand/apps/commands/a.cpp": 'if (term == "lateral") return;',
        "src/steadyhand/operator/server/b.hpp": "double lateral_weight;", "web/src/c.ts": "slider('lateral')",
        "web/src/d.ts": "page.fill('#lateral')", "web/index.html": '<input id="lateral">',
    }  # fmt: skip
    others = {"web/src/innocent.ts": "lateral = 'bilateral'; // lateral \"laterally\"", "web/protocol/fixtures/e.json": '{"lateral": 1}'}
    for file, text in {**named, **others}.items():
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).write_text(text)
    terms = terms_of(tmp_path)
    assert terms == {"lateral": f"{TERMS}/objective_lateral.cpp"}
    assert {file for file, _ in mentions(tmp_path, terms)} == set(named)
