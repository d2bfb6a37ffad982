"""The documentation site: it builds without a warning, offline, and every page is reached."""

import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(os.environ.get("STEADYHAND_ROOT", Path(__file__).resolve().parents[2]))
needs_doxygen = pytest.mark.skipif(shutil.which("doxygen") is None, reason="Doxygen is not installed: setup/apt-docs.txt")


def build(folder, configuration=ROOT / "mkdocs.yml"):
    command = [sys.executable, "-m", "mkdocs", "build", "--config-file", configuration, "--site-dir", folder]
    return subprocess.run(command, cwd=ROOT, env=os.environ | {"NO_MKDOCS_2_WARNING": "1"}, capture_output=True, text=True)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder, begin = tmp_path_factory.mktemp("site"), time.monotonic()
    done = build(folder)
    assert done.returncode == 0 and "WARNING" not in done.stderr, done.stderr
    assert time.monotonic() - begin < 60
    return folder


def pages(folder):
    return {path.relative_to(folder).as_posix(): path.read_text() for path in folder.rglob("*.html") if "cpp" not in path.parts and "files" not in path.parts}


@needs_doxygen
def test_every_page_is_in_the_navigation(site):
    """mkdocs.yml makes a page that is not, and a dead link, a warning, and a warning an error."""
    navigation = re.search(r'<nav class="md-nav md-nav--primary.*?</nav>\s*</div>', (site / "index.html").read_text(), re.DOTALL)[0]
    reached = set(re.findall(r'href="((?!\.\.|http)[^"#]+\.html)"', navigation)) | {"index.html", "404.html"}
    assert set(pages(site)) == reached
    sources = {path.relative_to(ROOT / "docs").with_suffix(".html").as_posix() for path in (ROOT / "docs").rglob("*.md") if path.parent.name != "doxygen"}
    assert sources <= reached and len(sources) > 25


def test_dead_links_and_pages_outside_the_navigation_are_errors(tmp_path):
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs/index.md").write_text("# A\n[a](gone.md) [b](index.md#gone)\n")
    (tmp_path / "docs/lost.md").write_text("# B\n")
    (tmp_path / "mkdocs.yml").write_text(f"INHERIT: {ROOT}/mkdocs.yml\ndocs_dir: docs\nhooks: []\nnav: [index.md]\n")
    done = build(tmp_path / "site", tmp_path / "mkdocs.yml")
    assert done.returncode == 1
    assert done.stderr.count("WARNING") == 3 and all(each in done.stderr for each in ("gone.md", "#gone", "lost.md"))


@needs_doxygen
def test_no_page_asks_another_host(site):
    loads = r"""<(?:script|img|iframe|source|video|audio)\b[^>]*\bsrc="(?:https?:)?//|<link\b(?![^>]*rel="canonical")[^>]*href="(?:https?:)?//|url\(["']?(?:https?:)?//|@import"""
    texts = pages(site) | {path.name: path.read_text() for path in site.rglob("*.css")}
    assert len(texts) > 40
    assert [name for name, text in texts.items() if re.search(loads, text)] == []


@needs_doxygen
def test_no_markdown_is_left(site):
    """Python-Markdown wants blank lines around lists, tables and code, where forges do without."""
    left = []
    for name, text in pages(site).items():
        article = re.sub(r"<pre.*?</pre>|<code.*?</code>", "", "".join(re.findall(r"<article.*?</article>", text, re.DOTALL)), flags=re.DOTALL)
        left += [(name, each) for each in re.findall(r"<(?:p|li|td)>(.*?)</(?:p|li|td)>", article, re.DOTALL) if re.search(r"(?m)^\s*(?:[-*] |\d+\. )|^\|.*\|$|```|\]\(", each)]
    assert [each for each in left] == []


@needs_doxygen
def test_facts_are_those_of_the_program(site):
    said = {
        "reference/settings.html": ["glass.fill", "planner.rate", "server.max_rate"],
        "reference/commands.html": ["--hand-on-hardware", "--picture-pause S", "--unlock-protective-stop", "./steadyhand wheel"],
        "reference/included.html": ["xarm7", "wrist_3_joint", "liquid.margin", "Put the three things into the bin"],
        "reference/protocol.html": ["takeable", "emulatedPosition", "set_up", "tools[].liquid.least_freeboard"],
        "reference/topics.html": ["/joint_command", "/supervision", "spilled_share", "observation.state", "next.success"],
        "reference/python.html": ["steadyhand.Planner", "steadyhand.dataset.merge", "steadyhand.policies.Simulation"],
        "reference/cpp.html": ["../cpp/classsteadyhand_1_1Pipeline.html", "../cpp/structsteadyhand_1_1Plan.html"],
    }
    missing = [(page, each) for page, names in said.items() for each in names if each not in (site / page).read_text()]
    assert missing == [] and "facts:" not in "".join((site / page).read_text() for page in said)
    version = re.search(r"project\(steadyhand VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]
    assert f"steadyhand {version}" in (site / "index.html").read_text()


# Loaders of files, and the pages that describe their keys.
KEYS = {
    "robot_file": ["how-to/add-a-robot.md"],
    "profile_file": ["reference/profiles.md"],
    "cell_file": ["how-to/add-a-table.md"],
    "task_file": ["reference/tasks.md"],
    "shape_reader": ["how-to/add-a-robot.md", "how-to/add-a-table.md"],
}


@pytest.mark.parametrize("loader", KEYS)
def test_pages_name_every_key_of_a_file(loader):
    source = (ROOT / f"src/steadyhand/files/config/{loader}.cpp").read_text()
    keys = set(re.findall(r'\((?:\w+, )?"([a-z_]+)"(?=[,)])', source))
    code = re.findall(r"```.*?```|`[^`]+`", "".join((ROOT / "docs" / page).read_text() for page in KEYS[loader]), re.DOTALL)
    assert len(keys) > 8
    assert keys - set(re.findall(r"[a-z_]+", " ".join(code))) == set()
