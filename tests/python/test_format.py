"""The form of C++ sources and documents, see tests/format.py; what is wrong with one is put right by `./steadyhand format`."""

import importlib.util
import os
import shutil
from pathlib import Path

import pytest

ROOT = Path(os.environ.get("STEADYHAND_ROOT", Path(__file__).resolve().parents[2]))
spec = importlib.util.spec_from_file_location("format", ROOT / "tests/format.py")
form = importlib.util.module_from_spec(spec)
spec.loader.exec_module(form)

# Files and folders/ that are still to be put into form, a line each; none may be added.
EXCUSED = ROOT / "tests/unformatted.txt"
excused = tuple(EXCUSED.read_text().split()) if EXCUSED.exists() else ()
needs_clang_format = pytest.mark.skipif(not form.CLANG_FORMAT.exists(), reason="clang-format is not installed: ./steadyhand test does that")


def names(paths):
    return [str(path.relative_to(ROOT)) for path in paths]


@needs_clang_format
def test_sources_are_as_clang_format_leaves_them():
    files = form.sources()
    assert len(files) > 300
    wrong = [name for name in names(form.unformatted(files)) if not name.startswith(excused)]
    assert wrong == [], "run ./steadyhand format"


def test_no_line_of_a_source_is_too_long():
    found = [f"{path.relative_to(ROOT)}:{number}" for path in form.sources() for number in form.long_lines(path)]
    assert [place for place in found if not place.startswith(excused)] == []


@needs_clang_format
def test_what_is_out_of_form_is_seen(tmp_path):
    shutil.copy(ROOT / ".clang-format", tmp_path)
    good, bad, equation = (tmp_path / name for name in ("good.cpp", "bad.cpp", "equation.cpp"))
    good.write_text("int main() { return 0; }\n")
    bad.write_text("int main(){return 0;}\n")
    equation.write_text("//" + " x = a b;" * 15 + "\nint x;\n")
    assert form.unformatted([good, bad, equation]) == [bad]  # clang-format does not break an equation
    assert form.long_lines(equation) == [1] and form.long_lines(good) == []
    page = tmp_path / "page.md"
    page.write_text("\n".join(["a " * 70, "| " + "a " * 70 + "|", "```", "a " * 70, "```", "- " + "a" * 130, "    " + "a " * 70, "a " * 60]))
    assert form.long_lines(page) == [1]
