"""docs/reference/safety.md and the fault tests say the same: each row of its table is a test, and each test has a row."""

import re

from places import ROOT


def test_rows_and_tests_are_the_same():
    cells = re.findall(r"^\|.*\| ((?:`\w+`(?:, )?)+) \|$", (ROOT / "docs/reference/safety.md").read_text(), re.MULTILINE)
    rows = [name for cell in cells for name in re.findall(r"`(\w+)`", cell)]
    tests = re.findall(r"TEST_F\(Faults, (\w+)\)", (ROOT / "tests/session/live/faults_test.cpp").read_text())
    tests += re.findall(r"def (test_\w+)", (ROOT / "tests/python/test_live_faults.py").read_text())
    also = []
    for name in ("sessions", "tasks", "cameras", "policies"):
        also += re.findall(r"def (test_\w+)", (ROOT / f"tests/python/test_{name}.py").read_text())
    for path in (ROOT / "tests").rglob("*_test.cpp"):
        also += re.findall(r"^TEST(?:_F|_P)?\(\w+, (\w+)\)", path.read_text(), re.MULTILINE)
    assert len(rows) > 20 and len(rows) == len(set(rows))
    assert set(tests) <= set(rows) <= set(tests + also)


def test_the_table_of_states_names_all_of_them():
    text = (ROOT / "docs/reference/safety.md").read_text()
    states = re.findall(r'Name\{\w+, "(\w+)"', re.search(r"names_of\(SupervisionState.*?\n}", (ROOT / "src/steadyhand/session/supervise/supervision.hpp").read_text(), re.DOTALL).group(0))
    for state in states[:-1]:
        assert re.search(rf"^\| {state} \|", text, re.MULTILINE), state
