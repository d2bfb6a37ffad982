"""Every block of Python in docs/how-to/use-the-library.md runs as it stands and makes its plot; README's lines run, too."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import steadyhand

from places import ROOT

ENVIRONMENT = {**os.environ, "PYTHONPATH": str(Path(steadyhand.__file__).parents[1]), "MPLBACKEND": "agg"}


def blocks(document):
    return re.findall(r"```python\n(.*?)```", (ROOT / document).read_text(), re.DOTALL)


def test_the_page_has_its_examples():
    assert len(blocks("docs/how-to/use-the-library.md")) >= 3 and len(blocks("README.md")) == 1


@pytest.mark.parametrize("code", blocks("docs/how-to/use-the-library.md"), ids=lambda code: re.search(r'savefig\("(\w+)', code).group(1))
def test_an_example_makes_its_plot(code, tmp_path):
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stderr) == (0, "")
    [plot] = tmp_path.glob("*.png")
    assert plot.stat().st_size > 10_000


def test_the_lines_of_readme():
    names = {}
    exec(blocks("README.md")[0], names)
    q = names["q"]
    assert q.shape == (6,) and np.abs(q - names["arm"].robot.home).max() < 1e-3
