"""The form of C++ sources and documents, see tests/format.py; what is wrong with one is put right by `./steadyhand format`."""

import re
import shutil
import sys

import pytest

from places import ROOT

sys.path.insert(0, str(ROOT / "tests"))
import format as form  # noqa: E402
import words  # noqa: E402

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


# Expressions of tests/words.tsv in 1000 words, median and 90th percentile of words in a clause.
LIMITS = (1.0, 14, 24)
GROUPS = {"documents", "program", "page", "docstrings"}


def test_texts_are_in_plain_words():
    groups = words.groups()
    assert set(groups) == GROUPS
    for name, files in groups.items():
        rate, median, most, count = words.measure(files)
        assert count > 2000, name
        assert rate <= LIMITS[0] and median <= LIMITS[1] and most <= LIMITS[2], f"{name}: {rate:.2f}, {median}, {most}; python3 tests/words.py"


def test_expressions_are_found(tmp_path):
    source, page, script = (tmp_path / name for name in ("a.cpp", "a.ts", "a.py"))
    source.write_text("// told\n#include \"told.hpp\"\nf(\"he was {told} it \"\n  \"anew\", 'x', R\"(it leads the arm)\");\n")
    page.write_text("// it's told\nconst a = `${told} it was told`, b = 'a-told', c = \"Let go of it\";\n")
    script.write_text('"""Told twice, anew."""\nx = "they were led away"\n')
    assert [line[:2] for line in words.places(words.literals(source.read_text(), ".cpp"))] == [(3, "anew"), (4, "leads the")]
    assert [line[:2] for line in words.places(words.literals(page.read_text(), ".ts"))] == [(2, "told"), (2, "Let go")]
    assert [[line[:2] for line in words.places(texts)] for texts in words.python_texts(script)] == [[(1, "Told"), (1, "anew")], [(2, "led")]]
    assert words.places([(1, words.prose("# A\n```\ntold\n```\n`told` [as](told.md)\n\nWho comes\n"))]) == [(7, "Who comes", words.RULES[-4][1])]
    assert words.clauses([(1, "# A head of words\n\nOne two three; four\nfive six. Two words.\n| a b c | d |\n")]) == [3, 3]
