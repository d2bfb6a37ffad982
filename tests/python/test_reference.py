"""The reference of the C++ interface (docs/reference) is made without a complaint of Doxygen's."""

import importlib.util
import os
import re
import shutil
from pathlib import Path

import pytest

ROOT = Path(os.environ.get("STEADYHAND_ROOT", Path(__file__).resolve().parents[2]))
spec = importlib.util.spec_from_file_location("make_reference", ROOT / "docs/doxygen/make.py")
reference = importlib.util.module_from_spec(spec)
spec.loader.exec_module(reference)


@pytest.mark.skipif(shutil.which("doxygen") is None, reason="Doxygen is not installed: setup/apt-docs.txt")
def test_doxygen_does_not_complain(tmp_path):
    assert reference.make(tmp_path) == []
    pages = {path.name for path in (tmp_path / "html").glob("*.html")}
    front = re.sub(r"<code>.*?</code>", "", (tmp_path / "html/index.html").read_text())
    assert re.findall(r"(?<!>)steadyhand::\w+", front) == [], "names that lead nowhere"
    assert {"index.html", "classsteadyhand_1_1Pipeline.html", "structsteadyhand_1_1Plan.html"} <= pages


def test_what_counts_as_a_complaint():
    undocumented = "/x/src/steadyhand/{}/a.hpp:1: warning: Compound steadyhand::A is not documented."
    other = "/x/src/steadyhand/session/live/a.hpp:1: warning: argument 'b' of command @param is not found in the argument list"
    counted = [undocumented.format("planning/plan"), other, "error: Tag INPUT"]
    assert reference.complaints("\n".join([*counted, undocumented.format("session/live"), "  parameter 'a'"])) == counted
