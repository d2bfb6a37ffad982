"""The operator's page in Chromium and in Firefox against the program (web/e2e); screenshots stay in build/artefacts."""

import os
import re
import shutil
import signal
import subprocess
import sys

import pytest

from places import ROOT

NODE = shutil.which("node") or shutil.which("nodejs")
CHROMIUM = next((path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None)
# Under the name firefox Ubuntu has but a stub that asks for snap. Without a screen Firefox draws no WebGL.
FIREFOX = shutil.which("firefox-esr") if shutil.which("Xvfb") else None
# Of page and headset the short tier has these: the page opens, moves the arm, replays, comes back, and stops in every way.
SMOKE = {
    "page": ["opens to an arm", "keys lead the arm; Space stops it", "a recording appears in the list", "says that it is not connected",
             "a finger leads the arm", "on a phone what is pressed", "nothing lies over Stop"],
    "headset": ["B and Y stop", "B stops also"],
    "stops": [],
}


def cases(browser, name, why, *files, **tiers):
    absent = pytest.mark.skipif(browser is None, reason=why)
    return [pytest.param(browser, file, [], id=f"{name}-{file}", marks=[pytest.mark.long, absent]) for file in files] + [
        pytest.param(browser, file, only, id=f"{name}-{file}-short", marks=absent) for file, only in tiers.items()]


def run(command, environment):
    """What it wrote. Fails with that if it fails, or hangs: then it ends with its browser and its program."""
    with subprocess.Popen(command, cwd=ROOT / "web", env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          start_new_session=True) as process:
        try:
            output, _ = process.communicate(timeout=700)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            pytest.fail(f"did not end within 700 s:\n{process.communicate()[0]}")
    assert process.returncode == 0, output
    return output


# The headset is emulated by a package, in whichever browser: once is enough.
@pytest.mark.parametrize("browser, file, only", [
    *cases(CHROMIUM, "chromium", "no Chromium on this machine", "page", "headset", "first_quest", "data", "two_arms", **SMOKE),
    *cases(FIREFOX, "firefox", "no firefox-esr with Xvfb on this machine", "page", "stops"),
])
def test_page_in_a_browser(browser, file, only):
    environment = os.environ | {"STEADYHAND_ROOT": str(ROOT), "STEADYHAND_BROWSER": browser, "STEADYHAND_PYTHON": sys.executable}
    command = [NODE, "--test", *(f"--test-name-pattern=^{re.escape(name)}" for name in only), f"e2e/{file}.test.mjs"]
    output = run(command, environment)
    ran = [name for name in re.findall(r"^ok \d+ - (.*)$", output, re.MULTILINE) if " # SKIP" not in name]
    assert len(ran) == len(only) if only else ran, output
