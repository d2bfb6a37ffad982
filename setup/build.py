"""Builds targets of a CMake preset in build/PRESET.

    python3 setup/build.py PRESET [-DNAME=VALUE...] TARGET...

In build/release the parts of setup/install.py are built that were asked for by -DSTEADYHAND_WITH_PART=ON, once or before. Talks
to stderr only: progress as one line on a terminal and as one line in a log. Exit code 1 if it failed.
"""

import os
import re
import shutil
import subprocess
import sys

from install import PARTS, ROOT, call, end, locked, say


def configure(preset, switches):
    """Unless build/PRESET is configured with these switches, for this place, after CMakePresets.json."""
    folder, presets = ROOT / "build" / preset, ROOT / "CMakePresets.json"
    cache = folder / "CMakeCache.txt"
    text = cache.read_text() if cache.exists() else ""
    if text and f"\nCMAKE_HOME_DIRECTORY:INTERNAL={ROOT}\n" not in text:  # the checkout has moved
        shutil.rmtree(folder)
        text = ""
    if not text and preset == "release":
        switches = [f"-DSTEADYHAND_WITH_{part}=OFF" for part in PARTS] + switches
    known = all(re.search(f"^{re.escape(name)}:[A-Z]+={re.escape(value)}$", text, re.MULTILINE) for name, value in (each[2:].split("=", 1) for each in switches))
    if text and known and (folder / "build.ninja").exists() and presets.stat().st_mtime <= cache.stat().st_mtime:
        return
    done = subprocess.run(["cmake", "--preset", preset, *switches], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace")
    (ROOT / f"build/{preset}-configure.log").write_text(done.stdout)
    if done.returncode:
        sys.stderr.write(done.stdout)
        end(1, "CMake failed, see above")


def show(lines):
    """Ninja's progress; what is left of its output are complaints."""
    terminal, started = sys.stderr.isatty(), False
    for line in lines:
        if step := re.match(r"@(\d+/(\d+))@ (?!Re-)", line):
            if terminal:
                sys.stderr.write(f"\r\033[Ksteadyhand: building, step {step[1]}")
                sys.stderr.flush()
            elif not started:
                say(f"building, {step[2]} steps")
            started = True
        elif not re.match(r"@.*@ Re-|ninja: (no work to do\.|Entering directory)|-- ", line):
            print(line, end="", file=sys.stderr)
    if started and terminal:
        sys.stderr.write("\r\033[K")


def main(preset, *words):
    switches, targets = [word for word in words if word.startswith("-D")], [word for word in words if not word.startswith("-D")]
    with locked(ROOT / f"build/{preset}.lock"):
        configure(preset, switches)
        environment = {**os.environ, "NINJA_STATUS": "@%f/%t@ "}
        command = ["ninja", "-C", str(ROOT / "build" / preset), "-j", str(len(os.sched_getaffinity(0))), *targets]
        with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, close_fds=False, text=True, errors="replace") as ninja:
            show(ninja.stdout)
        if ninja.returncode:
            end(1, f"the {preset} build failed, see above")


if __name__ == "__main__":
    call(main, *sys.argv[1:])
