"""What MkDocs does on top (mkdocs.yml): pages of the repository's root, links to its other files, facts of the program, Doxygen's reference."""

import os
import re
import sys
from pathlib import Path

from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File

ROOT = Path(__file__).resolve().parents[2]
sys.path += [str(ROOT / "docs/site"), str(ROOT / "docs/doxygen")]
import facts  # noqa: E402
import make  # noqa: E402

LINK = re.compile(r"(?<=\]\()<?([^)>\s#]+)(#[^)>\s]*)?>?(?=\))")
FENCE = re.compile(r"(?ms)(^```.*?^```$)")
CPP = ROOT / "build/doxygen"


def source(uri):
    """The file of the repository that is this page of the site."""
    return ROOT / uri.removeprefix("project/") if uri.startswith("project/") else ROOT / "docs" / uri


def target(path):
    """Where the site has a file of the repository; None: nowhere."""
    path = path / "README.md" if (path / "README.md").is_file() else path
    if path == ROOT / "README.md":
        return "index.md"
    if not path.is_file() or not path.is_relative_to(ROOT):
        return None
    name = path.relative_to(ROOT).as_posix()
    return name.removeprefix("docs/") if name.startswith("docs/") else f"project/{name}" if path.suffix == ".md" else f"files/{name}"


def on_config(config):
    for section in config.nav:  # MkDocs complains of pages that no section names
        section |= {name: [uri for uri in uris if source(uri).is_file()] for name, uris in section.items() if isinstance(uris, list)}
    version = re.search(r"project\(steadyhand VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]
    config.site_name = f"steadyhand {version}"


def on_files(files, config):
    """Pages of the root that the navigation names, files that pages link to, and Doxygen's."""
    complaints = make.make(CPP)
    if complaints:
        raise PluginError("\n".join(complaints))
    for path in (CPP / "html").rglob("*.*"):
        files.append(File.generated(config, f"cpp/{path.relative_to(CPP / 'html').as_posix()}", abs_src_path=str(path)))
    waiting = [file.src_uri for file in files.documentation_pages()] + re.findall(r"project/[\w/]+\.md", str(config.nav))
    while waiting:
        uri = waiting.pop()
        if uri not in files.src_uris:
            files.append(File.generated(config, uri, abs_src_path=str(source(uri) if uri.startswith("project/") else ROOT / uri.removeprefix("files/"))))
        if uri.endswith(".md"):
            linked = {target((source(uri).parent / link).resolve()) for link, _ in LINK.findall(source(uri).read_text()) if ":" not in link}
            waiting += linked - set(files.src_uris) - {None}
    return files


def on_page_markdown(markdown, page, config, files):
    parts = FENCE.split(markdown)
    return "".join(f"\n{part}\n" if i % 2 else as_markdown(part, page.file.src_uri) for i, part in enumerate(parts))


def as_markdown(text, uri):
    """What forges show, in the words of Python-Markdown."""

    def moved(found):
        path = (source(uri).parent / found[1]).resolve()
        if path == ROOT / "README.md":  # whose place the first page takes
            return os.path.relpath("how-to/install.md" if found[2] == "#install" else "index.md", os.path.dirname(uri) or ".")
        there = target(path) if ":" not in found[1] else None
        return found[0] if there is None else os.path.relpath(there, os.path.dirname(uri) or ".") + (found[2] or "")

    def fact(found):
        if not hasattr(facts, found[1]):
            raise PluginError(f"{uri}: there are no facts named {found[1]}")
        return getattr(facts, found[1])()

    folder = re.compile(r"(?<!!)\[([^\]\n]+)\]\(([^)\s#:]+)\)")  # the site has no folders
    text = folder.sub(lambda found: found[1] if (path := source(uri).parent / found[2]).is_dir() and not target(path.resolve()) else found[0], text)
    text = LINK.sub(moved, text).replace("][", "]\\[")
    text = re.sub(r"(?m)^> \[!(\w+)\]\n((?:>.*\n?)*)", lambda found: f'!!! {found[1].lower()}\n{re.sub(r"(?m)^> ?", "    ", found[2])}', text)
    return re.sub(r"<!-- facts: (\w+) -->", fact, "\n".join(apart(text.split("\n"))))


def apart(lines):
    """Blank lines around tables and before lists; in a list what belongs to an item is 4 columns further in."""
    width, before, loose = 0, "", False
    for line in lines:
        item, table = re.match(r"(?:[-*]|\d+\.) +", line), line.startswith("|")
        begins = item and (loose or not width) or table != before.startswith("|")
        if begins and before and line:
            yield ""
        if item:
            width, loose = len(item[0]), False
        elif width and not before and line and not line.startswith(" "):
            width = 0
        loose = loose or width > 0 and not line
        yield " " * (4 - width) + line if width and not item and line.startswith(" " * width) else line
        before = line
