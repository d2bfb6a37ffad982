"""`./steadyhand format` gives every C++ file the form of .clang-format; tests/python/test_format.py holds them to it.

What clang-format leaves alone counts as well: comments, and the prose of documents, have lines of at most 120 columns.
"""

import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(os.environ.get("STEADYHAND_ROOT", Path(__file__).resolve().parents[1]))
CLANG_FORMAT = Path(sys.prefix) / "bin/clang-format"  # pinned in setup/requirements-test.txt
COLUMNS = 120
FOLDERS = ("src", "tests", "bench", "examples")


def sources():
    return sorted(path for folder in FOLDERS for kind in ("cpp", "hpp") for path in (ROOT / folder).rglob(f"*.{kind}"))


def unformatted(files):
    """Those that clang-format would change."""
    shares = [share for i in range(os.cpu_count()) if (share := files[i::os.cpu_count()])]
    command = [CLANG_FORMAT, "--dry-run", "--ferror-limit=1"]
    with ThreadPoolExecutor() as pool:
        said = pool.map(lambda share: subprocess.run([*command, *share], capture_output=True, text=True, check=True).stderr, shares)
        wrong = {line.split(":")[0] for words in said for line in words.splitlines() if "[-Wclang-format-violations]" in line}
    return [path for path in files if str(path) in wrong]


def long_lines(path):
    """Numbers of lines beyond the last column; in documents but for tables, code and what has no blank to break at."""
    lines = path.read_text().split("\n")
    numbers = [i for i, line in enumerate(lines, 1) if len(line) > COLUMNS]
    if path.suffix != ".md":
        return numbers
    code, found = False, []
    for i, line in enumerate(lines, 1):
        if line.lstrip().startswith("```"):
            code = not code
        if i in numbers and not code and not line.startswith(("|", "    ")) and re.search(r"\S\s+\S", line[:COLUMNS].lstrip("-# ")):
            found.append(i)
    return found


def main():
    files = sources()
    subprocess.run([CLANG_FORMAT, "-i", *files], check=True)
    for path in files:
        for number in long_lines(path):
            print(f"{path.relative_to(ROOT)}:{number} is longer than {COLUMNS} columns", file=sys.stderr)


if __name__ == "__main__":
    main()
