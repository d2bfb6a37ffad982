"""docs/pictures/make.mjs still finds what it draws."""

import os
import shutil
import subprocess

import pytest

from places import PROGRAM, ROOT

NODE = shutil.which("node") or shutil.which("nodejs")
CHROMIUM = next((path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None)


@pytest.mark.long
@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
def test_pictures_are_made(tmp_path):
    environment = os.environ | {"STEADYHAND_ROOT": str(ROOT), "STEADYHAND_PROGRAM": str(PROGRAM), "STEADYHAND_PICTURES": str(tmp_path)}
    done = subprocess.run([NODE, ROOT / "docs/pictures/make.mjs", "report", "page_light"], env=environment, capture_output=True, text=True,
                          timeout=900)
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "report.png").stat().st_size > 50_000 and (tmp_path / "page_light.webp").stat().st_size > 10_000
