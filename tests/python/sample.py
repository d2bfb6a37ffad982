"""Where the program `write_sample` is, and what it writes: a recording and a report made by formulas."""

import os
import subprocess
from pathlib import Path

ROOT = Path(os.environ.get("STEADYHAND_ROOT", Path(__file__).resolve().parents[2]))
PROGRAM = Path(os.environ.get("STEADYHAND_PROGRAM", ROOT / "build/release/steadyhand"))
ARTEFACTS = ROOT / "build/artefacts"


def write_sample(folder: Path) -> Path:
    """Fills `folder` with sample.mcap and report.html."""
    writer = PROGRAM.parent / "write_sample"
    assert writer.exists(), f"{writer} is missing: build the target `tests`"
    subprocess.run([writer, folder], check=True, capture_output=True)
    return folder
