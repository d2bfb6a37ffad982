"""Live sessions are recorded: those of the tests not among the user's. The mark `long` keeps a test for `./steadyhand test --long`."""

import atexit
import os
import shutil
import sys
import tempfile

import pytest
from places import PROGRAM

os.environ["XDG_DATA_HOME"] = tempfile.mkdtemp(prefix="steadyhand-test-data-")
atexit.register(shutil.rmtree, os.environ["XDG_DATA_HOME"], ignore_errors=True)

# The Python package as the build leaves it: `import steadyhand`.
sys.path.insert(0, str(PROGRAM.parent / "python"))


@pytest.fixture(scope="session")
def robot():
    import steadyhand

    return steadyhand.Robot("ur5e")


def pytest_configure(config):
    config.addinivalue_line("markers", "long: takes minutes; only in `./steadyhand test --long`")


# Files run side by side (pytest-xdist): those that take longest begin first.
LONGEST = ["test_page", "test_live_faults", "test_sessions", "test_adversary", "test_install", "test_report", "test_solve_against_casadi", "test_cameras"]


def pytest_collection_modifyitems(items):
    items.sort(key=lambda item: LONGEST.index(item.path.stem) if item.path.stem in LONGEST else len(LONGEST))
