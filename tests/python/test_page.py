"""The operator's page in Chromium and in Firefox against the program (web/e2e); screenshots stay in build/artefacts."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(os.environ.get("STEADYHAND_ROOT", Path(__file__).parents[2]))
NODE = shutil.which("node") or shutil.which("nodejs")
CHROMIUM = next((path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None)
# Under the name firefox Ubuntu has but a stub that asks for snap. Without a screen Firefox draws no WebGL.
FIREFOX = shutil.which("firefox-esr") if shutil.which("Xvfb") else None


@pytest.mark.parametrize("browser", [
    pytest.param(CHROMIUM, id="chromium", marks=pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")),
    pytest.param(FIREFOX, id="firefox", marks=[
        pytest.mark.long, pytest.mark.skipif(FIREFOX is None, reason="no firefox-esr with Xvfb on this machine")]),
])
def test_page_in_a_browser(browser):
    environment = os.environ | {"STEADYHAND_ROOT": str(ROOT), "STEADYHAND_BROWSER": browser}
    done = subprocess.run([NODE, "--test", "e2e/page.test.mjs"], cwd=ROOT / "web", env=environment, capture_output=True,
                          text=True, timeout=900)
    assert done.returncode == 0, done.stdout + done.stderr
