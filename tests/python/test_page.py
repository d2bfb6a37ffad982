"""The operator's page in Chromium and in Firefox against the program (web/e2e); screenshots stay in build/artefacts."""

import os
import re
import shutil
import signal
import subprocess
import sys
import warnings
from pathlib import Path

import pytest

ROOT = Path(os.environ.get("STEADYHAND_ROOT", Path(__file__).parents[2]))
NODE = shutil.which("node") or shutil.which("nodejs")
CHROMIUM = next((path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None)
# Under the name firefox Ubuntu has but a stub that asks for snap. Without a screen Firefox draws no WebGL.
FIREFOX = shutil.which("firefox-esr") if shutil.which("Xvfb") else None
MOST_TRIED_AGAIN = 2


def cases(browser, name, why, *files, tier=()):
    absent = pytest.mark.skipif(browser is None, reason=why)
    return [pytest.param(browser, file, id=f"{name}-{file}", marks=[*tier, absent]) for file in files]


def run(command, environment):
    """None: it hung, and was killed with its browser and its program."""
    with subprocess.Popen(command, cwd=ROOT / "web", env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          start_new_session=True) as process:
        try:
            output, _ = process.communicate(timeout=700)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            return None
        return subprocess.CompletedProcess(command, process.returncode, output)


# The headset is emulated by a package, in whichever browser: once is enough.
@pytest.mark.parametrize("browser, file", [
    *cases(CHROMIUM, "chromium", "no Chromium on this machine", "page", "stops", "headset", "first_quest"),
    *cases(CHROMIUM, "chromium", "no Chromium on this machine", "data", tier=[pytest.mark.long]),
    *cases(FIREFOX, "firefox", "no firefox-esr with Xvfb on this machine", "page", "stops", tier=[pytest.mark.long]),
])
def test_page_in_a_browser(browser, file):
    environment = os.environ | {"STEADYHAND_ROOT": str(ROOT), "STEADYHAND_BROWSER": browser, "STEADYHAND_PYTHON": sys.executable}
    command = [NODE, "--test", f"e2e/{file}.test.mjs"]
    # Chromium without a graphics card has once stopped drawing for good, on a machine that compiled beside it: what hung is tried again.
    done = run(command, environment) or run(command, environment)
    assert done, "hung twice"
    if done.returncode == 0:
        return
    failed = names("not ok", done.stdout)
    # What only a crowded machine makes fail passes alone, and is named. A stop has no second try.
    if file != "stops" and 0 < len(failed) <= MOST_TRIED_AGAIN and not any("stop" in name.lower() for name in failed):
        alone = run([*command[:2], *(f"--test-name-pattern=^{re.escape(name)}$" for name in failed), command[2]], environment)
        if alone and alone.returncode == 0 and names("ok", alone.stdout) == failed:
            warnings.warn(f"{file}.test.mjs passed at the second try only: {'; '.join(failed)}\n{done.stdout}", stacklevel=1)
            return
    pytest.fail(done.stdout)


def names(outcome, report):
    """Of the tests of a TAP report with this outcome that were not skipped, in order."""
    return [name for name in re.findall(rf"^{outcome} \d+ - (.*)$", report, re.MULTILINE) if " # SKIP" not in name]
