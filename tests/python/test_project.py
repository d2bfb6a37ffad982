"""What the repository says of itself: one version everywhere, and no link that leads nowhere."""

import re
import subprocess
import sys
from pathlib import Path
from urllib.parse import unquote

import pytest

from places import ROOT

sys.path.insert(0, str(ROOT / "setup"))
import release  # noqa: E402


def text(name):
    return (ROOT / name).read_text()


def one(pattern, name):
    found = re.findall(pattern, text(name), re.MULTILINE)
    assert found, f"{name} has no {pattern}"
    return found[0]


def test_one_version():
    version = one(r"^project\(steadyhand VERSION (\d+\.\d+\.\d+)", "CMakeLists.txt")
    assert set(release.versions().values()) == {version} and "CITATION.cff" in release.versions()
    assert re.fullmatch(r"Unreleased \((.*)\)|(\S+) - \S+", release.newest_section()[0]).expand(r"\1\2") == version
    # Python's packages take CMake's.
    project = one(r"(?s)^\[project\]\n(.*?)^\[", "pyproject.toml")
    assert re.search(r'^dynamic = \["version"\]', project, re.MULTILINE) and not re.search(r"^version", project, re.MULTILINE)
    rule = one(r"^metadata\.version = .*input = \"CMakeLists\.txt\", regex = '(.*)'}", "pyproject.toml")
    assert re.search(rule, text("CMakeLists.txt")).group("value") == version


def test_the_policy_names_this_version():
    page = text("docs/reference/versions.md")
    minor = one(r"^project\(steadyhand VERSION (\d+\.\d+)", "CMakeLists.txt")
    assert set(re.findall(r"\.so\.([\d.]*\d)", page)) == {minor} and f"find_package(steadyhand {minor})" in page
    files = [found for name in ("README.md", "docs/how-to/install.md") for found in re.findall(r"steadyhand[-_](\d+\.\d+\.\d+)[-_]", text(name))]
    assert len(files) > 3 and set(files) == {release.versions()["CMakeLists.txt"]}
    protocol = one(r"kProtocolVersion = (\d+)", "src/steadyhand/operator/protocol/page_messages.hpp")
    assert f"a separate version number, now {protocol}." in page and f"Version {protocol}." in text("docs/reference/protocol.md")


def documents():
    if (ROOT / ".git").exists():
        names = subprocess.run(["git", "-C", ROOT, "ls-files", "*.md"], capture_output=True, text=True, check=True).stdout.split()
    else:
        names = [str(path.relative_to(ROOT)) for pattern in ("*.md", "docs/**/*.md", "*/README.md") for path in ROOT.glob(pattern)]
    assert "README.md" in names
    return names


def prose(document):
    """Without blocks of code."""
    return re.sub(r"(?m)^    .*$", "", re.sub(r"(?ms)^ *```.*?^ *```", "", text(document)))


def anchors(document):
    """What `#...` may name: each heading, as forges write it."""
    heads = re.findall(r"(?m)^#+ (.*)$", prose(document))
    return {re.sub(r"[^\w\- ]", "", re.sub(r"\[(.*?)\]\(.*?\)", r"\1", head)).lower().replace(" ", "-") for head in heads}


def dead_links(document):
    dead = []
    for link in re.findall(r"\]\(<?([^)>\s]+)>?\)", re.sub(r"`[^`\n]*`", "", prose(document))):
        if re.match(r"\w+:", link):
            continue
        path, _, anchor = unquote(link).partition("#")
        target = (ROOT / document).parent / path if path else ROOT / document
        if not target.exists():
            dead.append(link)
        elif anchor and anchor not in anchors(target):
            dead.append(link)
    return dead


# Where a name of a file in `code` may begin.
BEGINNINGS = ["", "src/steadyhand", "python/steadyhand"]
WRITTEN_BY_CMAKE = {"core/configuration.hpp"}


def dead_names(document):
    """Files named in `code`, with their folder, that are not there. A NAME in capitals stands for any."""
    names = re.findall(r"`((?:[\w.-]+/)+[\w.-]+\.(?:cpp|hpp|py|md|mjs|ts|cmake|yaml|txt|json|cff|map))`", prose(document))
    places = [ROOT / each for each in BEGINNINGS] + [(ROOT / document).parent]
    return [name for name in names if not re.search(r"[A-Z]{4}", name) and name not in WRITTEN_BY_CMAKE
            and not any((place / name).exists() for place in places)]


@pytest.mark.parametrize("document", documents())
def test_no_link_is_dead(document):
    assert dead_links(document) + dead_names(document) == []


def test_a_dead_link_is_seen(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("# A head, `of` it\n[a](page.md#a-head-of-it) [b](gone.md) [c](page.md#nowhere) [d](#nowhere) [e](https://x.y/z.md)\n"
                    "`core/gone.hpp` `core/arrows.hpp` `rooms/NAME.cpp`\n```\n[f](gone.md)\n```\n")
    assert dead_links(page) == ["gone.md", "page.md#nowhere", "#nowhere"]
    assert dead_names(page) == ["core/gone.hpp"]


def test_settings_that_documents_name_are_there():
    keys = set(re.findall(r'"((?:\w+\.)+\w+)"', text("src/steadyhand/operator/console/settings.cpp")))
    assert "ros2.controller" in keys
    sections = "|".join({key.split(".")[0] for key in keys})
    named = {(document, key) for document in documents() if document != "CHANGELOG.md"
             for key in re.findall(rf"`(?:--set )?((?:{sections})\.(?!hpp|cpp|pem)\w+)", text(document))}
    assert len(named) > 20
    assert {(document, key) for document, key in named if key not in keys} == set()


def test_pictures_are_shown_and_small():
    shown = {Path(link).name for document in documents() for link in re.findall(r"!\[[^\]]*\]\(([^)]+)\)", text(document))}
    pictures = [path for path in (ROOT / "docs").rglob("*") if path.suffix in (".png", ".webp", ".svg", ".gif")]
    assert {path.name for path in pictures} == shown
    assert all(path.stat().st_size < 2e6 for path in pictures)


def unnamed(text):
    """What unnamed namespaces of a source define: types and variables by their names, functions by their whole heads."""
    found = []
    for block in re.findall(r"^namespace \{\n(.*?)^\}  // namespace$", text, re.MULTILINE | re.DOTALL):
        found += re.findall(r"^(?:struct|class|enum class) (\w+)(?= [^;]*\{)", block, re.MULTILINE)
        found += re.findall(r"^(?!using )(?:(?:inline|static|constexpr|const) )*[\w:<>]+ (\w+)(?:\[\w*\])?(?: = |\{)", block, re.MULTILINE)
        found += [" ".join(head.split()) for head in re.findall(r"^(?!template|struct|class|enum|using)\w[^\n;={}]*\([^;{}]*\)(?= \{$)", block, re.MULTILINE)]
    return found


def test_unnamed_namespaces_of_a_library_have_names_of_their_own():
    """The wheel compiles each library as one file (cmake/levels.cmake); nothing else does."""
    parts = {"terms": ["core", "geometry/collision", "geometry/robot", "planning/ocp"], "solvers": ["planning/solve", "planning/predict", "planning/plan"]}
    parts |= {name: [name] for name in ("planning/retarget", "planning/liquid", "planning/pipeline", "session/supervise", "files/config", "files/input", "files/record",
                                        "report/replay", "report/figures", "arms/driver", "apps/python")}  # fmt: skip
    source = ROOT / "src/steadyhand"
    libraries = {library: [file for part in folders for file in (source / part).rglob("*.cpp")] for library, folders in parts.items()}
    libraries["commands"] = [source / f"apps/commands/{name}.cpp" for name in ("run", "progress_bar", "describe_command", "replay_command", "solve_command")]
    twice = []
    for library, files in libraries.items():
        names = [name for file in files if "fatrop" not in file.parts for name in unnamed(file.read_text())]
        assert len(names) > 1 or library in ("planning/retarget", "planning/liquid", "report/replay"), library
        twice += [f"{library}: {name}" for name in sorted(set(names)) if names.count(name) > 1]
    assert twice == []
