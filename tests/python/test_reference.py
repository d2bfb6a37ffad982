"""The reference of the C++ interface (docs/reference) is made without a complaint of Doxygen's."""

import importlib.util
import os
import re
import shutil

import pytest

from places import ROOT

spec = importlib.util.spec_from_file_location("make_reference", ROOT / "docs/doxygen/make.py")
reference = importlib.util.module_from_spec(spec)
spec.loader.exec_module(reference)


@pytest.mark.skipif(shutil.which("doxygen") is None, reason="Doxygen is not installed: setup/apt-docs.txt")
def test_doxygen_does_not_complain(tmp_path):
    assert reference.make(tmp_path) == []
    pages = {path.name for path in (tmp_path / "html").glob("*.html")}
    front = re.sub(r"<(code|a) .*?</\1>|<code>.*?</code>", "", (tmp_path / "html/index.html").read_text())
    assert re.findall(r"steadyhand::\w+", front) == [], "names that lead nowhere"
    assert {"index.html", "classsteadyhand_1_1Pipeline.html", "structsteadyhand_1_1Plan.html"} <= pages


@pytest.mark.skipif(shutil.which("doxygen") is None, reason="Doxygen is not installed: setup/apt-docs.txt")
def test_a_symbol_without_a_docstring_is_a_complaint(tmp_path, monkeypatch):
    header = tmp_path / "a.hpp"
    header.write_text("#pragma once\n/// Documented.\nstruct Told {\n  int untold;\n};\n")
    monkeypatch.setattr(reference, "installed", lambda: [os.path.relpath(header, ROOT / "src")])
    complaints = [line for line in reference.make(tmp_path) if str(header) in line]
    assert len(complaints) == 1 and "untold" in complaints[0], complaints
