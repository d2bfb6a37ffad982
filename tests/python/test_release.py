"""The commit that a build names, and what a release checks and runs."""

import os
import re
import subprocess
import sys

import pytest
import yaml

from places import ROOT

sys.path.insert(0, str(ROOT / "setup"))
import install  # noqa: E402
import release  # noqa: E402

VERSION = release.versions()["CMakeLists.txt"]

GIT = {"GIT_CONFIG_GLOBAL": "/dev/null", **{f"GIT_{who}_{what}": "a@b.c" for who in ("AUTHOR", "COMMITTER") for what in ("NAME", "EMAIL")}}


def run(*command, cwd, **variables):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, cwd=cwd, env={**os.environ, **GIT, **variables}, timeout=60)


def make_repository(folder, *files):
    for name in files:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text((ROOT / name).read_text())
    for words in (["init", "-q"], ["add", "-A"], ["commit", "-qm", "begin"]):
        assert run("git", *words, cwd=folder).returncode == 0
    return folder


# ---- the commit that `steadyhand --version` prints


@pytest.fixture
def sources(tmp_path):
    (tmp_path / "sources").mkdir()
    return make_repository(tmp_path / "sources", ".gitattributes", "cmake/commit.cmake", "LICENSE")


def commit_of(folder, out):
    done = run("cmake", f"-DSOURCE={folder}", f"-DOUT={out}", "-P", folder / "cmake/commit.cmake", cwd=folder)
    assert (done.returncode, done.stderr) == (0, "")
    return re.search(r'kCommit = "(.*)";', out.read_text())[1]


def test_a_build_names_its_commit(sources, tmp_path):
    out = tmp_path / "commit.cpp"
    commit = commit_of(sources, out)
    assert len(commit) >= 7 and run("git", "rev-parse", "HEAD", cwd=sources).stdout.startswith(commit)
    os.utime(out, (1, 1))
    assert commit_of(sources, out) == commit and out.stat().st_mtime == 1  # not written: nothing is compiled again
    (sources / "new").write_text("")
    assert commit_of(sources, out) == commit
    (sources / "LICENSE").write_text("another")
    assert commit_of(sources, out) == f"{commit}-dirty"


def test_an_archive_names_its_commit_and_a_copy_none(sources, tmp_path):
    archive, copy = sources / "archive", sources / "copy"  # in a repository that is not theirs
    for folder in (archive, copy):
        folder.mkdir()
    assert run("sh", "-c", f"git archive HEAD | tar -x -C {archive}", cwd=sources).returncode == 0
    assert run("cp", "-r", sources / "cmake", copy, cwd=sources).returncode == 0
    out = tmp_path / "commit.cpp"
    assert commit_of(archive, out) == commit_of(sources, out)
    assert commit_of(copy, out) == "unknown"


# ---- the release


@pytest.fixture
def ready(tmp_path):
    """A repository that may be released, and on PATH Pythons that agree to everything."""
    make_repository(tmp_path, *release.versions(), "setup/release.py", "setup/install.py", ".gitignore")
    (tmp_path / ".gitignore").write_text("/bin\n/dist\n__pycache__\n")
    (tmp_path / "CHANGELOG.md").write_text(f"# Changelog\n\n## {VERSION} - 2026-12-24\n\n### Added\n- Snow.\n\n## 0.0.1 - 2026-01-01\n- Rain.\n")
    (tmp_path / "bin").mkdir()
    for python in release.PYTHONS:
        (tmp_path / "bin" / python).write_text("#!/bin/sh\n")
        (tmp_path / "bin" / python).chmod(0o755)
    run("git", "add", "-A", cwd=tmp_path)
    run("git", "commit", "-qm", "date", cwd=tmp_path)
    run("git", "tag", f"v{VERSION}", cwd=tmp_path)
    return tmp_path


def make_release(folder, *options):
    path = f"{folder}/bin:{os.environ['PATH']}"
    return run(sys.executable, "-B", "setup/release.py", *options, cwd=folder, PATH=path)


def test_a_dry_run_shows_the_commands_and_writes_the_notes(ready):
    (ready / "dist").mkdir()
    (ready / "dist/site.tar.gz").write_text("a site")
    done = make_release(ready, "--dry-run")
    assert (done.returncode, done.stdout) == (0, "")
    assert done.stderr.splitlines() == [f"steadyhand: {' '.join(command)}" for command in release.commands(VERSION)]
    assert (ready / "dist/NOTES.md").read_text() == "### Added\n- Snow.\n"
    checked = run("sha256sum", "--check", "SHA256SUMS", cwd=ready / "dist")
    assert checked.stdout == "site.tar.gz: OK\n"


def script_commands():
    """What ./steadyhand takes."""
    cases = re.findall(r"^ +(\w[\w |]*)\)", (ROOT / "steadyhand").read_text(), re.MULTILINE)
    return {word for case in cases for word in case.split(" | ")} | set(install.COMMANDS)


def test_every_command_of_a_release_is_one_of_the_script():
    for command in release.commands(VERSION):
        words = [word for word in command if word != "env" and "=" not in word]
        assert words[0] == "tar" or (words[0] == "./steadyhand" and words[1] in script_commands())


def test_a_command_that_fails_ends_the_release(ready):
    (ready / "steadyhand").write_text('#!/bin/sh\necho "$PYTHON $*"; test "$PYTHON" != python3.11\n')
    (ready / "steadyhand").chmod(0o755)
    run("git", "add", "-A", cwd=ready)
    run("git", "commit", "-qm", "script", "--amend", cwd=ready)
    run("git", "tag", "-f", f"v{VERSION}", cwd=ready)
    done = make_release(ready)
    assert (done.returncode, done.stdout) == (1, "python3.10 wheel\npython3.11 wheel\n")
    assert "'env PYTHON=python3.11 ./steadyhand wheel' failed" in done.stderr and not (ready / "dist/NOTES.md").exists()


@pytest.mark.parametrize(
    "change, message",
    [
        ("git tag -d v{v}; git tag v9.9.9", "this commit must have the tag v{v}; it has v9.9.9"),
        ("git tag -d v{v}", "this commit must have the tag v{v}; it has none"),
        ("sed -i '/ - 2026-12-24/d' CHANGELOG.md", "CHANGELOG.md must begin with a section '## {v} - YEAR-MONTH-DAY'; it has '## 0.0.1 - 2026-01-01'"),
        ("sed -i 's/^## {v}.*/## Unreleased ({v})/' CHANGELOG.md", "it has '## Unreleased ({v})'"),
        ("echo >> CITATION.cff", "the tree is not clean: M CITATION.cff"),
        ("touch new.py", "the tree is not clean: ?? new.py"),
        ("rm -rf .git", "the tree is not clean: fatal: not a git repository"),
        ("sed -i 's/^version: .*/version: 9.9.9/' CITATION.cff", "CITATION.cff has version 9.9.9; CMakeLists.txt has {v}"),
        ("sed -i '/^version = /d' python/lerobot/robot/pyproject.toml", "python/lerobot/robot/pyproject.toml has version none; CMakeLists.txt has {v}"),
        ("mkdir dist; touch dist/old.whl", "dist/ has packages of an earlier run: delete it"),
        ("printf '#!/bin/sh\nexit 1\n' > bin/python3.12", "python3.12 with pip is not on PATH: its wheel cannot be built"),
    ],
)  # fmt: skip
def test_what_is_not_ready_is_refused(ready, change, message):
    assert run("sh", "-c", change.replace("{v}", VERSION), cwd=ready, GIT_CEILING_DIRECTORIES=str(ready.parent)).returncode == 0
    for options in ((), ("--dry-run",)):
        done = make_release(ready, *options)
        assert (done.returncode, done.stdout) == (2, "") and f"{message.replace('{v}', VERSION)}" in done.stderr
        assert (ready / "dist/NOTES.md").exists() == bool(options)  # without --dry-run nothing is done


def test_an_unknown_option_is_refused():
    done = run("./steadyhand", "release", "--dry", cwd=ROOT)
    assert (done.returncode, done.stderr) == (2, "steadyhand: release takes --dry-run or nothing, not '--dry'\n")


# ---- its workflow


@pytest.mark.parametrize("path", sorted((ROOT / ".github/workflows").glob("*.yml")), ids=lambda path: path.stem)
def test_workflows_run_what_there_is(path):
    jobs = yaml.safe_load(path.read_text())["jobs"]
    steps = [step for job in jobs.values() for step in job["steps"]]
    ours = [words.split() for step in steps for words in re.findall(r"(?:^|&& |\w=\S+ )(\.\S*/.*)", step.get("run", ""), re.MULTILINE)]
    assert len(ours) > 0
    for words in ours:
        assert os.access(ROOT / words[0], os.X_OK) and (words[0] != "./steadyhand" or words[1] in script_commands())
    assert all(re.fullmatch(r"[\w-]+/[\w-]+@v\d[\d.]*", step["uses"]) for step in steps if "uses" in step)
    assert all(need in jobs for job in jobs.values() for need in [job.get("needs")] if need)


def test_a_person_turns_publishing_on_and_only_tags_make_a_release():
    workflow = yaml.safe_load((ROOT / ".github/workflows/release.yml").read_text())
    assert workflow[True] == {"push": {"tags": ["v*"]}}  # YAML reads `on` as true
    assert workflow["permissions"] == {"contents": "read"}
    publishing = {name: job for name, job in workflow["jobs"].items() if any("pypi-publish" in step.get("uses", "") for step in job["steps"])}
    assert [job["if"] for job in publishing.values()] == ["vars.PUBLISH == 'true'"]
    asked = {name: job.get("permissions", {}) for name, job in workflow["jobs"].items()}
    assert asked == {"build": {}, "release": {"contents": "write", "id-token": "write", "attestations": "write"}, "index": {"id-token": "write"}}
