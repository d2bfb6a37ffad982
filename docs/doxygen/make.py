"""The reference of the installed headers, a part of the site of `./steadyhand docs`. Fails if Doxygen complains, as it does of
every symbol that has no docstring."""

import os
import re
import subprocess
from pathlib import Path

ROOT = Path(os.environ.get("STEADYHAND_ROOT", Path(__file__).resolve().parents[2]))


def installed():
    """The headers that cmake/install.cmake installs: what the facades include, directly or not."""
    waiting, found = re.findall(r"steadyhand/\w+\.hpp", (ROOT / "cmake/install.cmake").read_text()), set()
    while waiting:
        header = waiting.pop()
        if header not in found and (ROOT / "src" / header).exists():
            found.add(header)
            waiting += re.findall(r'^#include "(steadyhand/[^"]+)"', (ROOT / "src" / header).read_text(), re.MULTILINE)
    return sorted(found)


def make(folder):
    """The complaints."""
    folder.mkdir(parents=True, exist_ok=True)
    headers = " ".join(f"src/{header}" for header in installed())
    version = re.search(r"project\(steadyhand VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text()).group(1)
    settings = (ROOT / "docs/doxygen/Doxyfile").read_text()
    settings += f"INPUT = docs/doxygen/main.md {headers}\nPROJECT_NUMBER = {version}\nOUTPUT_DIRECTORY = {folder}\n"
    done = subprocess.run(["doxygen", "-"], input=settings, cwd=ROOT, capture_output=True, text=True)
    complaints = [line for line in done.stderr.splitlines() if "warning:" in line or "error:" in line]
    return complaints or ([] if done.returncode == 0 else [done.stderr])
