"""The form of C++ sources and documents, see tests/format.py; what is wrong with one is put right by `./steadyhand format`."""

import importlib.util
import os
import re
import shutil
from pathlib import Path

import pytest

ROOT = Path(os.environ.get("STEADYHAND_ROOT", Path(__file__).resolve().parents[2]))
spec = importlib.util.spec_from_file_location("format", ROOT / "tests/format.py")
form = importlib.util.module_from_spec(spec)
spec.loader.exec_module(form)

needs_clang_format = pytest.mark.skipif(not form.CLANG_FORMAT.exists(), reason="clang-format is not installed: ./steadyhand test does that")


def names(paths):
    return [str(path.relative_to(ROOT)) for path in paths]


@needs_clang_format
def test_sources_are_as_clang_format_leaves_them():
    files = form.sources()
    assert len(files) > 300
    assert names(form.unformatted(files)) == [], "run ./steadyhand format"


def test_no_line_of_a_source_is_too_long():
    found = [f"{path.relative_to(ROOT)}:{number}" for path in form.sources() for number in form.long_lines(path)]
    assert found == []


def test_abs_is_not_that_of_integers():
    """A plain abs(double) is C's, of int, where no other header happens to bring std's to all, as with gcc for AArch64."""
    calls = re.compile(r"(?<![\w:.>])abs\(")
    found = [path for path in form.sources() if not path.name.startswith("lanes") and calls.search(path.read_text()) and "using std::abs" not in path.read_text()]
    assert names(found) == [], "say std::abs, or using std::abs where Lanes come, too"


@needs_clang_format
def test_what_is_out_of_form_is_seen(tmp_path):
    shutil.copy(ROOT / ".clang-format", tmp_path)
    good, bad, equation = (tmp_path / name for name in ("good.cpp", "bad.cpp", "equation.cpp"))
    good.write_text("int main() { return 0; }\n")
    bad.write_text("int main(){return 0;}\n")
    equation.write_text("//" + " x = a b;" * 15 + "\nint x;\n")
    assert form.unformatted([good, bad, equation]) == [bad]  # clang-format does not break an equation
    assert form.long_lines(equation) == [1] and form.long_lines(good) == []


def test_long_comments_go_on_in_the_next_line():
    words = "a " * 58
    assert form.wrap_comments(f"  // {words}bcd e\n  // f\n  g();\n") == f"  // {words.strip()}\n  // bcd e f\n  g();\n"
    assert form.wrap_comments(f"/// {words}bcd\nint x;\n") == f"/// {words.strip()}\n/// bcd\nint x;\n"
    assert form.wrap_comments(f"/// {words}bcd\n/// @param x\n") == f"/// {words.strip()}\n/// bcd\n/// @param x\n"
    assert form.wrap_comments(f"  f(); // {words}bcd\n") == f"  f(); // {words}bcd\n"


def test_documents_are_wrapped_but_for_tables_code_and_links():
    long = "ab " * 45
    assert form.wrap("short\nlines\n") == "short\nlines\n"
    kept = [f"| {long}|", f"    {long}x", f"```\n{long}x\n```", f"# {long}x", f"[{long}](x.md)", f"`{long}`"]
    assert [each for each in kept if form.wrap(each) != each] == []
    wrapped = form.wrap(f"- {long}\n  cd - ef\n- gh\n\n{long}\nij\n").split("\n")
    assert all(len(line) <= form.COLUMNS for line in wrapped) and " ".join(" ".join(wrapped).split()) == f"- {long}cd - ef - gh {long}ij"
    assert [line for line in wrapped if not line.startswith(("- ab", "  ab", "- gh", "ab"))] == ["", ""]
    assert form.wrap(" ".join(["ab"] * 40) + " - cd").split("\n")[1] == "ab - cd"  # not the begin of a list
