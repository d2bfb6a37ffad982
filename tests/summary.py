"""The end of `./steadyhand test`: `summary.py FOLDER` reads what ctest, googletest and pytest left there as JUnit XML.

FOLDER/NAME/ctest.xml with a googletest file for each executable beside it, and FOLDER/pytest.xml. Prints a line for each
failure and for each skip with its reason, a line for each run, and `N passed, N failed, N skipped` at last.
"""

import sys
import xml.etree.ElementTree as ET
from pathlib import Path

PASSED, FAILED, SKIPPED = "passed", "failed", "skipped"


def outcome(case):
    """What came of a <testcase>, and why, if it was skipped."""
    if case.find("failure") is not None or case.find("error") is not None or case.get("status") == "fail":
        return FAILED, ""
    skipped = case.find("skipped")
    if skipped is not None:
        message = skipped.get("message", "").strip() or "for no reason"
        if case.get("status") == "notrun" and not message.startswith("SKIP_"):  # ctest: there is no such program, say
            return FAILED, message
        said = (case.findtext("system-out") or "").strip()
        return SKIPPED, (said or message).splitlines()[-1].strip()
    return PASSED, ""


def cases(file):
    if not file.exists():
        return [("ended without its results", FAILED, "")]
    return [(f"{case.get('classname')}.{case.get('name')}", *outcome(case)) for case in ET.parse(file).iter("testcase")]


def ctest_cases(folder):
    """Of each executable its cases; itself if it has none, or died before it could tell."""
    if not (folder / "ctest.xml").exists():
        return cases(folder / "ctest.xml")
    found = []
    for case in ET.parse(folder / "ctest.xml").iter("testcase"):
        own = folder / f"test_{case.get('name')}.xml"
        inner = cases(own) if own.exists() else []
        outer, reason = outcome(case)
        found += inner
        if not inner or (outer == FAILED and all(what != FAILED for _, what, _ in inner)):
            found.append((case.get("name"), outer, reason))
    return found


def main(folder):
    runs = {f"ctest ({each.name})": ctest_cases(each) for each in sorted(folder.iterdir()) if each.is_dir()}
    runs["pytest"] = cases(folder / "pytest.xml")
    total = {PASSED: 0, FAILED: 0, SKIPPED: 0}
    lines = []
    for run, results in runs.items():
        count = {kind: sum(what == kind for _, what, _ in results) for kind in total}
        lines.append(f"{run}: " + ", ".join(f"{n} {kind}" for kind, n in count.items()))
        for kind, n in count.items():
            total[kind] += n
        for name, what, reason in results:
            if what != PASSED:
                print(f"{what}: {run} {name}" + (f": {reason}" if reason else ""))
    print(*lines, sep="\n")
    print(", ".join(f"{n} {kind}" for kind, n in total.items()))
    return 1 if total[FAILED] or not total[PASSED] else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
