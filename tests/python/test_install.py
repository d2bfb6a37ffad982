"""`cmake --install`, moved to another folder, and used from there by a program of somebody else's that is compiled for
another processor; the same as a subproject."""

import os
import re
import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from places import PROGRAM, ROOT

BUILD = PROGRAM.parent
CONSUMER = ROOT / "tests/install/consumer"
LEVELS = {"x86-64": [], "x86-64-v3": ["avx2"], "native": []}
BROUGHT = re.compile(r"Eigen/\w+|[a-z_]+")  # Eigen, and the standard library


def run(*command, **options):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=900, **options)
    assert done.returncode == 0, f"{command}\n{done.stdout[-4000:]}\n{done.stderr[-4000:]}"
    return done.stdout


def host_can(flags):
    words = re.search(r"^flags.*", Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    return words is not None and set(flags) <= set(words.group(0).split())


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    """Installed in one place and moved to another."""
    folder = tmp_path_factory.mktemp("install")
    run("cmake", "--install", BUILD, "--prefix", folder / "first")
    shutil.move(folder / "first", folder / "moved")
    return folder / "moved"


def build_consumer(folder, *options):
    readme = folder / "readme.cpp"
    readme.write_text(re.search(r"```cpp\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL).group(1))
    run("cmake", "-S", CONSUMER, "-B", folder, "-G", "Ninja", f"-DREADME={readme}", *options)
    run("cmake", "--build", folder)
    return folder


@pytest.fixture(scope="module")
def consumer(prefix, tmp_path_factory):
    """Builds, once for a processor, what uses the library from outside."""
    made = {}

    def of(level):
        if level not in made:
            options = (f"-DCMAKE_PREFIX_PATH={prefix}", f"-DCMAKE_CXX_FLAGS=-march={level} -O1")
            made[level] = build_consumer(tmp_path_factory.mktemp("consumer"), *options)
        return made[level]

    return of


def test_the_program_of_the_readme_runs_for_another_processor_than_the_librarys(consumer, tmp_path):
    environment = {key: value for key, value in os.environ.items() if not key.startswith("STEADYHAND")}
    assert len(run(consumer("x86-64") / "readme", cwd=tmp_path, env=environment).split()) == 500 * 6
    assert "Plan::u" in run(consumer("x86-64") / "layout")


@pytest.mark.long
@pytest.mark.parametrize("what", ["readme", "terms", "layout"])  # terms to a millimetre: there the caller computes, too
def test_what_uses_the_library_does_the_same_whatever_processor_it_is_compiled_for(consumer, tmp_path, what):
    said = {level: run(consumer(level) / what, cwd=tmp_path) for level, flags in LEVELS.items() if host_can(flags)}
    assert len(said) > 1 and len(set(said.values())) == 1, said


@pytest.mark.long
def test_the_examples_are_built_outside(prefix, tmp_path):
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    run("cmake", "-S", tmp_path / "examples", "-B", tmp_path / "build", "-G", "Ninja", f"-DCMAKE_PREFIX_PATH={prefix}")
    run("cmake", "--build", tmp_path / "build")
    assert "100% tests passed" in run("ctest", "--test-dir", tmp_path / "build", "--output-on-failure")


def test_the_program_works_where_it_was_moved(prefix, tmp_path):
    environment = {key: value for key, value in os.environ.items() if not key.startswith("STEADYHAND")}
    run(prefix / "bin/steadyhand", "replay", "--until", "2", "--out", tmp_path, cwd=tmp_path, env=environment)
    assert (tmp_path / "waiter/plan.csv").exists()


def test_the_program_loads_mujoco_where_it_was_moved(prefix, tmp_path):
    if not list(prefix.glob("share/steadyhand/packages/mujoco/libmujoco.so.*")):
        pytest.skip("MuJoCo is not installed")
    environment = {key: value for key, value in os.environ.items() if not key.startswith("STEADYHAND")}
    run(prefix / "bin/steadyhand", "demo", "--arm", "mujoco", "--headless", "--no-recording", "--seconds", "0.2", cwd=tmp_path, env=environment)


@pytest.mark.parametrize("asked, said", [("0.3 COMPONENTS planning live", ""), ("0.2", 'requested version "0.2"'),
                                         ("0.3 COMPONENTS plan", "it has no component plan; there is planning, and live if")])  # fmt: skip
def test_what_cannot_be_found_is_told(prefix, tmp_path, asked, said):
    (tmp_path / "CMakeLists.txt").write_text(
        f"cmake_minimum_required(VERSION 3.25)\nproject(user LANGUAGES CXX)\nfind_package(steadyhand {asked} REQUIRED)\n"
    )
    command = ["cmake", "-S", tmp_path, "-B", tmp_path / "build", f"-DCMAKE_PREFIX_PATH={prefix}"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    words = " ".join(done.stderr.split())
    assert done.returncode == (1 if said else 0) and said in words, words


def test_macros_of_eigen_that_would_move_members_are_compile_errors(prefix):
    command = ["g++", "-std=c++20", "-fsyntax-only", "-DEIGEN_DONT_VECTORIZE", "-DEIGEN_DEFAULT_TO_ROW_MAJOR", "-DEIGEN_DEFAULT_DENSE_INDEX_TYPE=int",
               "-isystem", "/usr/include/eigen3", str(prefix / "include/steadyhand/core/math.hpp")]  # fmt: skip
    errors = re.findall(r"static assertion failed: (.*)", subprocess.run(command, capture_output=True, text=True).stderr)
    assert [error.split()[0] for error in errors] == ["define", "EIGEN_DONT_VECTORIZE", "EIGEN_DEFAULT_TO_ROW_MAJOR", "EIGEN_DEFAULT_DENSE_INDEX_TYPE"]


def included(header):
    return re.findall(r'^#include ([<"])([^>"]+)', header.read_text(), re.MULTILINE)


def test_headers_include_only_what_find_package_brings(prefix):
    headers = sorted((prefix / "include").rglob("*.hpp"))
    missing = [f"{header}: {name}" for header in headers for kind, name in included(header)
               if not ((prefix / "include" / name).is_file() if kind == '"' else BROUGHT.fullmatch(name))]  # fmt: skip
    assert 20 < len(headers) <= 40 and missing == []  # the interface: what else there is may change at any time


@pytest.mark.long
def test_each_header_compiles_alone(prefix):
    def compile_alone(header):
        command = ["g++", "-std=c++20", "-fsyntax-only", "-w", "-DEIGEN_MAX_ALIGN_BYTES=16", f"-I{prefix}/include",
                   "-isystem", "/usr/include/eigen3", "-include", header, "-x", "c++", "/dev/null"]  # fmt: skip
        return subprocess.run([str(word) for word in command], capture_output=True, text=True).stderr[:500]

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        complaints = list(pool.map(compile_alone, sorted((prefix / "include").rglob("*.hpp"))))
    assert [words for words in complaints if words] == []


def test_no_file_names_the_checkout(prefix):
    needle = str(ROOT).encode()
    assert [str(path) for path in prefix.rglob("*") if path.is_file() and needle in path.read_bytes()] == []


def test_no_symbol_of_another_library_is_shown(prefix):
    """What was compiled of Eigen for this processor must not stand in for what a user compiles."""
    for name in ("planning", "live"):
        shown = run("nm", "-DC", "--defined-only", prefix / f"lib/libsteadyhand_{name}.so")
        names = [line.split(maxsplit=2)[2] for line in shown.splitlines()]
        assert len(names) > 100 and [n for n in names if "steadyhand::" not in n] == []


@pytest.mark.long
def test_it_is_a_subproject_that_needs_neither_node_nor_a_wheel(tmp_path):
    folder = build_consumer(
        tmp_path, f"-DSTEADYHAND_SOURCE={ROOT}", f"-DSTEADYHAND_DEPS={tmp_path}/none", "-DCMAKE_CXX_FLAGS=-march=x86-64 -O1"
    )
    refused = subprocess.run([folder / "readme"], capture_output=True, text=True, timeout=60)
    packages = folder / "steadyhand/share/steadyhand/packages"  # the URDF's is data, not for the build
    assert refused.returncode == 2 and refused.stderr.strip().endswith(f"--no-deps --target '{packages}' airo-models")
    packages.symlink_to(BUILD / "share/steadyhand/packages")
    assert len(run(folder / "readme").split()) == 500 * 6
