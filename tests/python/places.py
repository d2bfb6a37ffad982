"""Where the repository and the program under test are."""

import os
from pathlib import Path

ROOT = Path(os.environ.get("STEADYHAND_ROOT", Path(__file__).resolve().parents[2]))
PROGRAM = Path(os.environ.get("STEADYHAND_PROGRAM", ROOT / "build/release/steadyhand"))
