"""What is compiled for a browser needs no operating system: no file of it includes, by whatever way, a header of files, threads,
sockets, or of a library that is not headers alone. Quick, where compiling for WebAssembly takes minutes (test_site.py)."""

import json
import re

from places import ROOT

SOURCE = ROOT / "src"
FORBIDDEN = re.compile(r"filesystem|fstream|thread|mutex|condition_variable|future|dlfcn\.h|pthread\.h|sched\.h|signal\.h|csignal"
                       r"|sys/.*|netinet/.*|arpa/.*|boost/.*|openssl/.*|urdf.*|tinyxml2\.h|yaml-cpp/.*|zstd\.h|assimp/.*|CLI/.*|qrencode\.h|fatrop/.*")
# It asks the standard library whether there are threads.
EXCEPT = {"steadyhand/core/mutex.hpp": {"mutex"}}


def compiled():
    """The parts' files, as CMakeLists.txt lists them without an operating system (BARE)."""
    parts = (ROOT / "cmake/wasm.cmake").read_text().split("foreach(part ", 1)[1].split(")", 1)[0].split()
    text = (ROOT / "CMakeLists.txt").read_text()
    for part in parts:
        words = re.search(rf"steadyhand_part\(((?:\w+/)?{part})\s([^)]*)\)", text)
        bare = re.search(r"\bBARE\s+((?:[a-z0-9_]+\s*)+)", words[2])
        folder = SOURCE / "steadyhand" / words[1]
        files = [folder / f"{name}.cpp" for name in bare[1].split()] if bare else sorted(folder.rglob("*.cpp"))
        yield from (file for file in files if file.parent.name != "fatrop")


def includes(file, seen):
    """(system header, the file that names it) of a file and all of ours that it includes."""
    for quoted, system in re.findall(r'^\s*#\s*include\s+(?:"([^"]+)"|<([^>]+)>)', file.read_text(), re.M):
        if system:
            yield system, file.relative_to(SOURCE).as_posix()
        elif quoted not in seen and quoted != "steadyhand/core/configuration.hpp":  # which CMake writes
            seen.add(quoted)
            yield from includes(SOURCE / quoted, seen)


def test_a_browser_needs_no_operating_system():
    files = list(compiled())
    assert len(files) > 60
    seen = set()
    found = [(system, name) for file in files for system, name in includes(file, seen)]
    assert "steadyhand/operator/protocol/hub.hpp" in seen and ("Eigen/Core", "steadyhand/core/math.hpp") in found
    wrong = sorted({f"{name} includes <{system}>" for system, name in found
                    if FORBIDDEN.fullmatch(system) and system not in EXCEPT.get(name, ())})
    assert wrong == []


def test_what_this_machine_has_is_no_part_of_the_browsers_build():
    options = set(re.findall(r"^option\((STEADYHAND_WITH_\w+)", (ROOT / "CMakeLists.txt").read_text(), re.MULTILINE))
    presets = {each["name"]: each for each in json.loads((ROOT / "CMakePresets.json").read_text())["configurePresets"]}
    off = {name for name, value in presets["wasm"]["cacheVariables"].items() if value == "OFF"}
    assert options - off <= {"STEADYHAND_WITH_LIVE"}
