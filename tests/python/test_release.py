"""The commit that a build names, and what a release checks and runs."""

import os
import re
import subprocess

import pytest

from places import ROOT

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
