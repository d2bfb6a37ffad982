"""`./steadyhand docs`: the reference of the installed headers, in build/docs/html. Fails if Doxygen complains.

What is undocumented counts in the rooms that people begin with.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(os.environ.get("STEADYHAND_ROOT", Path(__file__).resolve().parents[2]))
DOCUMENTED = ("robot", "retarget", "predict", "track", "plan", "pipeline")


def installed_rooms():
    calls = re.findall(r"steadyhand_library\(\w+ ([^)]*)\)", (ROOT / "CMakeLists.txt").read_text())
    rooms = [word for call in calls for word in call.split("ROOMS", 1)[1].split() if word != "OPTIONAL"]
    assert set(DOCUMENTED) < set(rooms)
    return rooms


def internal():
    """Folders and headers of these rooms that are not installed."""
    text = (ROOT / "cmake/install.cmake").read_text()
    rooms = re.search(r"list\(REMOVE_ITEM rooms ([^)]*)\)", text).group(1).split()
    headers = re.search(r"foreach\(header ([^)]*)\)", text).group(1).split()
    return [f"src/steadyhand/{room}" for room in rooms] + [f"src/steadyhand/{header}.hpp" for header in headers]


def complaints(words):
    """Doxygen's, but for what need not be documented."""
    begin = re.compile(rf"/steadyhand/(?!(?:{'|'.join(DOCUMENTED)})/)\w+/.*is not documented\.$")
    return [line for line in words.splitlines() if "warning:" in line and not begin.search(line) or "error:" in line]


def make(folder):
    """The complaints."""
    folder.mkdir(parents=True, exist_ok=True)
    headers = " ".join(f"src/steadyhand/{room}" for room in installed_rooms())
    version = re.search(r"project\(steadyhand VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text()).group(1)
    settings = (ROOT / "docs/reference/Doxyfile").read_text()
    settings += f"INPUT = docs/reference/main.md {headers}\nEXCLUDE = {' '.join(internal())}\nPROJECT_NUMBER = {version}\nOUTPUT_DIRECTORY = {folder}\n"
    done = subprocess.run(["doxygen", "-"], input=settings, cwd=ROOT, capture_output=True, text=True)
    return complaints(done.stderr) or ([] if done.returncode == 0 else [done.stderr])


if __name__ == "__main__":
    found = make(ROOT / "build/docs")
    for line in found:
        print(line, file=sys.stderr)
    print(f"steadyhand: the reference is {ROOT / 'build/docs/html/index.html'}", file=sys.stderr)
    sys.exit(1 if found else 0)
