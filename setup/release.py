"""Builds what a release consists of, in dist/: wheels, Debian packages, the site, notes and checksums. Uploads nothing.

    python3 setup/release.py [--dry-run]

--dry-run shows the commands instead and writes only the notes. Exit codes: 1 if a command failed, 2 if something is to be corrected first.
"""

import hashlib
import re
import shutil
import subprocess
import sys

from install import ROOT, call, end, say

DIST = ROOT / "dist"
VERSIONS = {
    "CMakeLists.txt": r"^project\(steadyhand VERSION (\S+)",  # pyproject.toml reads it there
    "CITATION.cff": r"^version: (\S+)$",
    "package.xml": r"<version>(.*)</version>",
    "python/lerobot/robot/pyproject.toml": r'^version = "(.*)"$',
    "python/lerobot/teleoperator/pyproject.toml": r'^version = "(.*)"$',
}
# One wheel for each version of Python; that of the last one, with the stable ABI, is for all later ones, too.
PYTHONS = ("python3.10", "python3.11", "python3.12")


def versions():
    """By file, the version that it names; "none" if it has no such line."""
    texts = {name: (ROOT / name).read_text() for name in VERSIONS if (ROOT / name).exists()}
    return {name: (re.findall(VERSIONS[name], text, re.MULTILINE) or ["none"])[0] for name, text in texts.items()}


def newest_section():
    """Heading and text of the newest section of CHANGELOG.md."""
    heading, _, text = (ROOT / "CHANGELOG.md").read_text().partition("\n## ")[2].partition("\n")
    return heading, text.split("\n## ")[0].strip() + "\n"


def git(*words):
    return subprocess.run(["git", "-C", ROOT, *words], capture_output=True, text=True)


def problems(version):
    for name, other in versions().items():
        if other != version:
            yield f"{name} has version {other}; CMakeLists.txt has {version}"
    heading, text = newest_section()
    if not re.fullmatch(rf"{re.escape(version)} - \d{{4}}-\d\d-\d\d", heading) or not text.strip():
        yield f"CHANGELOG.md must begin with a section '## {version} - YEAR-MONTH-DAY'; it has '## {heading}'"
    status = git("status", "--porcelain")
    if status.returncode or status.stdout:
        yield f"the tree is not clean: {(status.stderr or status.stdout).splitlines()[0].strip()}"
    tags = git("tag", "--points-at", "HEAD").stdout.split()
    if f"v{version}" not in tags:
        yield f"this commit must have the tag v{version}; it has {', '.join(tags) or 'none'}"
    if list(DIST.glob("*.whl")) + list(DIST.glob("*.deb")):
        yield "dist/ has packages of an earlier run: delete it"
    for python in PYTHONS:
        if not shutil.which(python) or subprocess.run([python, "-m", "pip", "--version"], capture_output=True).returncode:
            yield f"{python} with pip is not on PATH: its wheel cannot be built"


def commands(version):
    """Each with the variables that it takes."""
    yield from (["env", f"PYTHON={python}", "./steadyhand", "wheel"] for python in PYTHONS)
    yield ["./steadyhand", "deb"]
    yield ["env", "STEADYHAND_DEMO=1", "./steadyhand", "docs"]
    yield ["./steadyhand", "site", "--out", "build/docs/demo"]
    yield ["tar", "-czf", f"dist/steadyhand-{version}-site.tar.gz", "-C", "build/docs", "."]


def main(*words):
    if words not in ((), ("--dry-run",)):
        end(2, f"release takes --dry-run or nothing, not '{' '.join(words)}'")
    version = versions()["CMakeLists.txt"]
    found = list(problems(version))
    for problem in found:
        say(problem)
    if found and not words:
        sys.exit(2)
    DIST.mkdir(exist_ok=True)
    for command in commands(version):
        say(" ".join(command))
        if not words and subprocess.run(command, cwd=ROOT).returncode:
            end(1, f"'{' '.join(command)}' failed (its words are above)")
    (DIST / "NOTES.md").write_text(newest_section()[1])
    files = sorted(path for path in DIST.iterdir() if path.suffix in (".whl", ".deb", ".gz"))
    (DIST / "SHA256SUMS").write_text("".join(f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n" for path in files))
    sys.exit(2 if found else 0)


if __name__ == "__main__":
    call(main, *sys.argv[1:])
