"""docs/universal-robots.md and the fault tests say the same: each row of its table is a test, and each test has a row."""

import os
import re
from pathlib import Path

ROOT = Path(os.environ.get("STEADYHAND_ROOT", Path(__file__).resolve().parents[2]))


def test_rows_and_tests_are_the_same():
    rows = re.findall(r"^\|.*\| `(\w+)` \|$", (ROOT / "docs/universal-robots.md").read_text(), re.MULTILINE)
    source = (ROOT / "tests/arm/ur_faults_test.cpp").read_text()
    tests = re.findall(r"TEST(?:_F)?\((?:UrFaults|UrOverTcp), (\w+)\)", source)
    assert len(rows) > 10 and sorted(rows) == sorted(tests)
