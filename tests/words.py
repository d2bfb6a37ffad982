"""Counts expressions of tests/words.tsv, and lengths of clauses, in what users read.

    python3 tests/words.py [--all] [FILE...]

Prints a table of the groups and the files with most; with FILEs, or with --all, each place and what to write instead.
"""

import ast
import re
import statistics
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path += [str(ROOT / "tests"), str(ROOT / "docs/doxygen")]
import format  # noqa: E402
import make  # noqa: E402

RULES = [(re.compile(rule, re.IGNORECASE | re.MULTILINE), instead) for rule, instead in
         (line.split("\t") for line in (ROOT / "tests/words.tsv").read_text().splitlines() if line[:1] not in ("", "#"))]  # fmt: skip
WORD = re.compile(r"[A-Za-z']+")
LITERAL = {
    ".cpp": re.compile(r"""//[^\n]*|/\*.*?\*/|'(?:\\.|[^'\\\n])'|R"(\w*)\((?P<raw>.*?)\)\1"|(?P<text>"(?:\\.|[^"\\\n])*"(?:\s*"(?:\\.|[^"\\\n])*")*)""", re.DOTALL),
    ".ts": re.compile(r"""//[^\n]*|/\*.*?\*/|(?P<text>'(?:\\.|[^'\\\n])*'|"(?:\\.|[^"\\\n])*"|`(?:\\.|[^`\\])*`)""", re.DOTALL),
}  # fmt: skip


def blank(pattern, text, by=""):
    """The lines stay where they are."""
    return re.sub(pattern, lambda found: by + "\n" * found[0].count("\n"), text, flags=re.DOTALL | re.MULTILINE)


def prose(text):
    """A document without code and targets of links."""
    return blank(r"\]\([^)]*\)", blank(r"`[^`]*`", blank(r"^ *```.*?^ *```", text), "x"), "]")


def literals(text, kind):
    """Line and text of string literals of two words and more."""
    for found in LITERAL[kind].finditer(text):
        words = found.groupdict().get("raw") or found["text"]
        if words:
            words = re.sub(r"\$?\{[^{}]*\}", "x", re.sub(r'"\s*"|\\n', " ", words).strip("\"'`"))
            if len(re.findall(r"[a-z]{2,}(?= )| [a-z]{2,}", words)) > 1:
                yield text.count("\n", 0, found.start()) + 1, words


def python_texts(path):
    """Line and text of docstrings, and of other literals."""
    tree = ast.parse(path.read_text())
    documented = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    texts = [node for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value.count(" ") > 1]
    return [[(node.lineno, node.value) for node in texts if (id(node) in documented) == wanted] for wanted in (True, False)]


def groups():
    """For each group its files, each with lines and texts."""
    sources = [path for path in sorted((ROOT / "src").rglob("*.?pp"))]
    python = {path: python_texts(path) for path in sorted((ROOT / "python/steadyhand").rglob("*.py"))}
    page = [*sorted((ROOT / "web/src").rglob("*.ts")), *sorted((ROOT / "web").glob("*.html")), *sorted((ROOT / "web/src").rglob("*.html"))]
    comments = re.compile(r"(?:^ *///.*\n)+|///<?[^\n]*", re.MULTILINE)

    def headers(path):
        text = path.read_text()
        return [(text.count("\n", 0, found.start()) + 1, re.sub(r" *///<? ?", "", found[0])) for found in comments.finditer(text)]

    def read_page(path):
        text = path.read_text()
        tags = r"""<(?:"[^"]*"|[^>"])*>"""
        told = [(text.count("\n", 0, found.start()) + 1, found[1]) for found in re.finditer(r'(?:title|aria-label|placeholder)="([^"]*)"', text)]
        return [*literals(text, ".ts")] if path.suffix == ".ts" else [(1, blank(tags, text)), *told]

    return {
        "documents": {path: [(1, prose(path.read_text()))] for path in format.documents() if path.name != "THIRD_PARTY.md"},
        "program": {path: [*literals(path.read_text(), ".cpp")] for path in sources} | {path: texts[1] for path, texts in python.items()},
        "page": {path: read_page(path) for path in page},
        "docstrings": {ROOT / "src" / name: headers(ROOT / "src" / name) for name in make.installed()} | {path: texts[0] for path, texts in python.items()},
    }  # fmt: skip


def places(texts):
    """Line, words and what to write instead."""
    return [(line + text.count("\n", 0, found.start(0) + len(found[0]) - len(found[0].lstrip())), " ".join(found[0].split()), instead)
            for line, text in texts for rule, instead in RULES for found in rule.finditer(text)]  # fmt: skip


def clauses(texts):
    """Numbers of words between full stops, colons and semicolons; without tables, headings and code."""
    paragraphs = [each for _, text in texts for each in re.split(r"\n\s*\n|\n(?=[-*|#\d])", text) if not each.startswith(("|", "#", "    "))]
    counts = [len(WORD.findall(clause)) for each in paragraphs for clause in re.split(r"(?<=[.!?:;])\s+", each.replace("\n", " "))]
    return [count for count in counts if count > 2]


def measure(files):
    """Expressions in 1000 words, median and 90th percentile of words in a clause, and all words."""
    words = sum(len(WORD.findall(text)) for texts in files.values() for _, text in texts)
    lengths = [length for texts in files.values() for length in clauses(texts)]
    return 1000 * sum(len(places(texts)) for texts in files.values()) / words, statistics.median(lengths), statistics.quantiles(lengths, n=10)[8], words


def main(options):
    all_groups = groups()
    wanted = {Path(each).resolve() for each in options if each != "--all"}
    if options:
        for path in sorted({path for files in all_groups.values() for path in files if not wanted or path in wanted}):
            texts = [each for files in all_groups.values() for each in files.get(path, [])]
            for line, words, instead in sorted(places(texts)):
                print(f"{path.relative_to(ROOT)}:{line}: {words}  ->  {instead}")
    else:
        rates = [(1000 * len(places(texts)) / words, words, path.relative_to(ROOT)) for files in all_groups.values() for path, texts in files.items()
                 if (words := sum(len(WORD.findall(text)) for _, text in texts)) > 100]  # fmt: skip
        for rate, words, path in sorted(rates, reverse=True)[:15]:
            print(f"{rate:6.1f} in 1000 of {words:6d} words  {path}")
    for name, files in all_groups.items():
        files = {path: texts for path, texts in files.items() if not wanted or path in wanted}
        if any(clauses(texts) for texts in files.values()):
            rate, median, most, words = measure(files)
            print(f"{name:10}  {rate:5.1f} in 1000 of {words:6d} words; a clause has {median:.0f} words in the median, {most:.0f} at 90 %")


if __name__ == "__main__":
    main(sys.argv[1:])
