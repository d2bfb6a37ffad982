"""docs/ros2.md and the fault tests say the same: each row of its table is a test, and each test has a row."""

import os
import re
from pathlib import Path

ROOT = Path(os.environ.get("STEADYHAND_ROOT", Path(__file__).resolve().parents[2]))


def test_rows_and_tests_are_the_same():
    rows = re.findall(r"^\|.*\| `(\w+)` \|$", (ROOT / "docs/ros2.md").read_text(), re.MULTILINE)
    source = (ROOT / "tests/ros2/faults_test.cpp").read_text()
    tests = re.findall(r"TEST_F\(Ros2Faults, (\w+)\)", source)
    assert len(rows) > 10 and sorted(rows) == sorted(tests)
