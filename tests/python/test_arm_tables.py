"""The pages of the arms and the fault tests say the same: each row of a page's table is a test, and each test has a row."""

import re

import pytest

from places import ROOT


@pytest.mark.parametrize(
    ("page", "sources", "fixtures"),
    [
        ("docs/reference/ros2.md", ["tests/arms/ros2/faults_test.cpp", "tests/arms/ros2/ros2_gripper_test.cpp"], "Ros2Faults|Ros2ArmWithGripper"),
        ("docs/reference/ur.md", ["tests/arms/ur/faults_test.cpp", "tests/arms/ur/connection_test.cpp"], "UrFaults|UrOverTcp|UrConnection"),
    ],
)
def test_rows_and_tests_are_the_same(page, sources, fixtures):
    rows = re.findall(r"^\|.*\| `(\w+)` \|$", (ROOT / page).read_text(), re.MULTILINE)
    tests = re.findall(rf"TEST(?:_F)?\((?:{fixtures}), (\w+)\)", "".join((ROOT / source).read_text() for source in sources))
    assert len(rows) > 10 and sorted(rows) == sorted(tests)
