"""What docs/how-to/troubleshooting.md quotes is what the program, its page, ./steadyhand and pip say."""

import re
from pathlib import Path

import pip

from places import ROOT

PIP = Path(pip.__file__).parent


def sources():
    """All that can be said, with literals that go on in the next line joined."""
    paths = [ROOT / "steadyhand", *(ROOT / "src").rglob("*.cpp"), *(ROOT / "src").rglob("*.hpp"), *(ROOT / "web/src").rglob("*.ts"),
             *(ROOT / "python").rglob("*.py"), *(ROOT / "cmake").glob("*.cmake"), *(ROOT / "setup").glob("*.py"), *(PIP / "_internal").rglob("*.py"), PIP / "_vendor/urllib3/connection.py"]
    return re.sub(r'"\s*\n\s*"', "", "\n".join(path.read_text() for path in paths))


def quotes(page):
    """In the first column of each table, what is written as code and is more than a word."""
    cells = re.findall(r"^\| (.*?) \|", page, re.MULTILINE)
    return [quote for cell in cells for quote in re.findall(r"`([^`]+)`", cell) if " " in quote and quote != "adb devices"]


def unsaid(page, said):
    return [quote for quote in quotes(page) if not all(part.strip(" ;,%'") in said for part in quote.split("…"))]


def test_every_message_is_one_of_the_program():
    page = (ROOT / "docs/how-to/troubleshooting.md").read_text()
    assert len(quotes(page)) > 50
    assert unsaid(page, sources()) == []


def test_a_message_that_nobody_says_is_seen():
    page = "| seen | cause |\n|---|---|\n| `the … is on fire` | |\n| `CMake failed, see above`, `demo` | |\n"
    assert unsaid(page, sources()) == ["the … is on fire"]
