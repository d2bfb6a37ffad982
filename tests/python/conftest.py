"""Live sessions are recorded: those of the tests not among the user's. The mark `long` keeps a test for `./steadyhand test --long`."""

import atexit
import os
import shutil
import tempfile

os.environ["XDG_DATA_HOME"] = tempfile.mkdtemp(prefix="steadyhand-test-data-")
atexit.register(shutil.rmtree, os.environ["XDG_DATA_HOME"], ignore_errors=True)


def pytest_configure(config):
    config.addinivalue_line("markers", "long: takes minutes; only in `./steadyhand test --long`")
