"""`./steadyhand format` gives every C++ file the form of .clang-format, and documents lines of at most 120 columns.

tests/python/test_format.py holds them to it. clang-format does not touch comments, so that equations stay whole: what is too long
of one goes to the next line.
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
    """Numbers of lines beyond the last column; in documents those that wrap() would break."""
    lines = path.read_text().split("\n")
    if path.suffix != ".md":  # literals cannot be broken
        return [i for i, line in enumerate(lines, 1) if len(line) > COLUMNS and "//" in line and 'R"(' not in line]
    return [i for i, line in enumerate(lines, 1) if len(line) > COLUMNS and line not in wrap("\n".join(lines)).split("\n")]


BEGINS = re.compile(r"\s*(?:[-*+]|\d+\.)\s+|\s*")  # an item of a list, or nothing
OWN_LINE = re.compile(r"\s*$|\s*(#|\||>|```|!\[|<|---)|    ")  # what is no prose
WORD = re.compile(r"(?:`[^`]*`|\[[^\]]*\]\([^)]*\)|[^\s`\[]|`|\[)+")  # code and links stay whole


def wrap(text):
    """A document with its prose in lines of at most COLUMNS; paragraphs without a long line stay as they are."""
    out, paragraph, code = [], [], False

    def finish():
        if not any(len(line) > COLUMNS for line in paragraph):
            out.extend(paragraph)
        elif paragraph:
            head = BEGINS.match(paragraph[0]).group(0)
            line, rest = head, " " * len(head)
            words = []
            for word in WORD.findall(" ".join(paragraph)[len(head):]):
                if words and re.match(r"[-*+#>|]|\d+\.$", word):  # would begin a list or a heading, and so does not begin a line
                    words[-1] += " " + word
                else:
                    words.append(word)
            for word in words:
                if line not in (head, rest) and len(line) + 1 + len(word) > COLUMNS:
                    out.append(line)
                    line = rest
                line += word if line in (head, rest) else " " + word
            out.append(line)
        paragraph.clear()

    for line in text.split("\n"):
        if line.lstrip().startswith("```"):
            code = not code
        in_item = paragraph and BEGINS.match(paragraph[0]).group(0).strip()
        if code or OWN_LINE.match(line) and not (in_item and re.match(r"\s+[^\s|#>`]", line)):
            finish()
            out.append(line)
        else:
            if BEGINS.match(line).group(0).strip():
                finish()
            paragraph.append(line)
    finish()
    return "\n".join(out)


def wrap_comments(text):
    """Sources with what is too long of a comment on the next line of that comment, or on one more."""
    lines, out = text.split("\n"), []
    for i, line in enumerate(lines):
        begin = re.match(r"\s*//[/!]? ", line)
        if not begin or len(line) <= COLUMNS:
            out.append(line)
            continue
        cut = line.rfind(" ", len(begin.group(0)), COLUMNS + 1)
        rest = line[cut + 1:]
        out.append(line[:cut])
        following = lines[i + 1] if i + 1 < len(lines) else ""
        prose = re.match(re.escape(begin.group(0)) + r"[^\s@\-]", following)
        if prose:
            lines[i + 1] = begin.group(0) + rest + " " + following[len(begin.group(0)):]
        else:
            lines.insert(i + 1, begin.group(0) + rest)
    return "\n".join(out)


def documents():
    return sorted(path for pattern in ("*.md", "docs/*.md", "docs/*/*.md", "*/README.md") for path in ROOT.glob(pattern)
                  if not {".deps", "build", "node_modules"} & set(path.parts))


def main():
    files = sources()
    subprocess.run([CLANG_FORMAT, "-i", *files], check=True)
    for path in documents():
        if long_lines(path):
            path.write_text(wrap(path.read_text()))
    for path in files:
        if long_lines(path):
            path.write_text(wrap_comments(path.read_text()))
        for number in long_lines(path):
            print(f"{path.relative_to(ROOT)}:{number} is longer than {COLUMNS} columns", file=sys.stderr)


if __name__ == "__main__":
    main()
