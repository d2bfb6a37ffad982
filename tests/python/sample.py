"""Where the program `write_sample` is, and what it writes: a recording and a report made by formulas."""

import subprocess
from pathlib import Path

from places import PROGRAM, ROOT

ARTEFACTS = ROOT / "build/artefacts"


def write_sample(folder: Path) -> Path:
    """Fills `folder` with sample.mcap and report.html."""
    writer = PROGRAM.parent / "write_sample"
    assert writer.exists(), f"{writer} is missing: build the target `tests`"
    subprocess.run([writer, folder], check=True, capture_output=True)
    return folder
