"""The first command of a checkout builds few parts, and this suite all of them: every file that asks for a part compiles without."""

import json
import re
import shlex
import subprocess
from concurrent.futures import ThreadPoolExecutor

from places import PROGRAM

PART = r"STEADYHAND_(?:CAMERA|FIT|MESHES|MUJOCO|RENDER|ROS2|SIMULATE|UR)"


def test_files_compile_without_the_parts_that_they_ask_for():
    commands = json.loads((PROGRAM.parent / "compile_commands.json").read_text())
    files = [entry for entry in commands if "/src/steadyhand/" in entry["file"] and re.search(rf"^#if.*{PART}", open(entry["file"]).read(), re.MULTILINE)]
    assert len(files) > 8

    def complaints(entry):
        words = [word for word in shlex.split(entry["command"]) if not re.match(f"-D{PART}", word)]
        words = words[: words.index("-o")] + ["-fsyntax-only", entry["file"]]
        done = subprocess.run(words, capture_output=True, text=True, cwd=entry["directory"], timeout=300)
        return [line for line in done.stderr.splitlines() if "error" in line] if done.returncode else []

    with ThreadPoolExecutor(2) as pool:
        assert [line for lines in pool.map(complaints, files) for line in lines] == []
