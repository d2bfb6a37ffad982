"""The site (docs/how-to/browser.md): WebAssembly plans what native code plans, its folder holds what it must, and the page's tests pass on
it. Long, since compiling for WebAssembly takes minutes: ./steadyhand test --long does, into build/wasm and build/wasm-plain."""

import gzip
import json
import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from test_page import CHROMIUM, FIREFOX, NODE, ROOT, run

BUILD = Path(os.environ.get("STEADYHAND_BUILD", ROOT / "build"))
pytestmark = [pytest.mark.long,
              pytest.mark.skipif(not (BUILD / "wasm/steadyhand.wasm").exists(), reason="not compiled for WebAssembly")]


def make(*words):
    environment = os.environ | {"STEADYHAND_BUILD": str(BUILD)}
    return subprocess.run([NODE, ROOT / "web/tools/make_site.mjs", *map(str, words)], env=environment, capture_output=True, text=True)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site") / "site"
    done = make("--out", folder)
    assert done.returncode == 0, done.stderr
    return folder


def test_the_folder_is_small_and_names_nobody_else(site):
    files = [path for path in site.rglob("*") if path.is_file()]
    packed = sum(len(gzip.compress(path.read_bytes())) for path in files)
    assert packed < 6e6, f"{packed} bytes"
    index = (site / "index.html").read_text()
    assert "default-src 'none'" in index and '<meta name="steadyhand-session" content="worker">' in index
    assert not re.findall(r'(?:src|href)="(?!data:|\./|#)', index), "addresses are relative"
    listed = json.loads((site / "site.json").read_text())["bytes"]
    assert {name: (site / name).stat().st_size for name in listed} == listed
    kept = json.loads(re.search(r"const files = (.*);", (site / "offline.js").read_text())[1])
    assert {"steadyhand.wasm", "robots/ur5e.json", "arms/ur5e.glb", "index.html"} <= set(kept)


def test_a_folder_of_others_and_a_robot_that_is_none_are_refused(site, tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    for words, said in [((), "--out DIR"), (("--out", tmp_path), "holds something else"), (("--out", tmp_path / "mine.txt"), "is no folder"),
                        (("--out", tmp_path / "new", "--robot", "ur50"), "ur50"), (("--out", tmp_path / "new", "--fast"), "--fast")]:
        done = make(*words)
        assert done.returncode == 2 and said in done.stderr, done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]
    assert make("--out", site).returncode == 0, "its own folder is written over"


def test_plans_are_those_of_native_code():
    """1000 closed-loop problems of each profile, and the commands of a session, on the same vectors of 2."""
    program = BUILD / "asan/closed_loop"
    if not program.exists():
        pytest.skip("not built: cmake --build build/asan --target closed_loop, as ./steadyhand test --long does")
    environment = os.environ | {"STEADYHAND_CLOSED_LOOP": str(program), "STEADYHAND_BUILD": str(BUILD)}
    done = subprocess.run([NODE, ROOT / "web/e2e/plans.mjs", "--no-browser", "--play", "20"], env=environment, cwd=ROOT / "web",
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    compared = [line for line in lines if "difference" in line]
    assert len(compared) >= 8 and all(line["difference"] < 1e-9 for line in compared), compared


def test_the_planner_without_a_page(site):
    environment = os.environ | {"STEADYHAND_ROOT": str(ROOT), "STEADYHAND_SITE": str(site)}
    run([NODE, "--test", "e2e/planner.test.mjs"], environment)


@pytest.mark.skipif(CHROMIUM is None or shutil.which("Xvfb") is None, reason="no Chromium or no Xvfb on this machine")
def test_a_tab_that_nobody_sees_leaves_the_arm_at_rest(site):
    environment = os.environ | {"STEADYHAND_ROOT": str(ROOT), "STEADYHAND_BROWSER": CHROMIUM, "STEADYHAND_SITE": str(site)}
    run([NODE, "e2e/endurance.mjs", "--minutes", "0"], environment)


BROWSERS = {"chromium": CHROMIUM, "firefox": FIREFOX}


@pytest.mark.parametrize("browser, file", [("chromium", "site"), ("chromium", "page"), ("chromium", "stops"), ("chromium", "headset"),
                                           ("firefox", "site"), ("firefox", "page")])
def test_the_site_in_a_browser(site, browser, file):
    if BROWSERS[browser] is None or shutil.which("python3") is None:
        pytest.skip(f"no {browser} on this machine")
    environment = os.environ | {"STEADYHAND_ROOT": str(ROOT), "STEADYHAND_BROWSER": BROWSERS[browser], "STEADYHAND_SITE": str(site)}
    run([NODE, "--test", f"e2e/{file}.test.mjs"], environment)
