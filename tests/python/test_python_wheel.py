"""`pip install .` in a clean environment, and the wheel of `./steadyhand wheel` in others: without compiler, on every level of
processor that this one has, and in a bare Debian."""

import json
import os
import re
import resource
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import pytest

from bare_debian import NEEDED, BareDebian, make_package
from places import ROOT

BASE = Path(sys.base_prefix) / "bin/python3"
# As on a machine that has never seen the project: no ccache, no Node, nothing of .deps.
CLEAN = {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "HOME": os.environ.get("HOME", "/root")}
LEVELS = {"x86-64-v4": "", "x86-64-v3": "-AVX512VL", "x86-64-v2": "-AVX512VL,-AVX2"}
FLAGS = {"x86-64-v4": {"avx512vl"}, "x86-64-v3": {"avx2"}, "x86-64-v2": set()}

USE = """
import json, numpy as np, steadyhand
robot = steadyhand.Robot("ur5e")
planner = steadyhand.Planner(robot, profile="waiter")
T = robot.fk(robot.home)
for i in range(40):
    T[1, 3] += 0.005
    plan = planner.update(T, 0.05 * i)
print(json.dumps([steadyhand.processor, plan.status, plan.at(2.0)[0].tolist(), float(plan.solve_us), steadyhand.__file__]))
"""

VERSION = ".".join(re.search(r"project\(steadyhand VERSION (\d+)\.(\d+)", (ROOT / "CMakeLists.txt").read_text()).groups())

# The program with its page, which Python reads, and whose address the program prints.
PAGE = r"""/opt/arm/bin/steadyhand demo --no-browser --no-recording --port 8700 > /tmp/said & sleep 3
/opt/arm/bin/python -c 'import gzip, re, urllib.request as r
page = gzip.decompress(r.urlopen(re.search("open +(http://[^ ]+)", open("/tmp/said").read())[1]).read())
assert b"<title>" in page and b"script" in page, page[:300]'; code=$?; kill -INT $!; exit $code"""

pytestmark = pytest.mark.long


def run(*command, **options):
    options = {"env": CLEAN, "timeout": 3600, **options}
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, **options)
    assert done.returncode == 0, f"{command}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
    return done.stdout


def environment(folder):
    run(BASE, "-m", "venv", folder)
    return folder / "bin/python"


def host_can(level):
    words = re.search(r"^flags.*", Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    return words is not None and FLAGS[level] <= set(words.group(0).split())


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    wheel = make_package("wheel", tmp_path_factory.mktemp("dist"))["steadyhand"]
    print(f"{wheel.name}: {wheel.stat().st_size / 1e6:.1f} MB")
    return wheel


def test_pip_installs_it_in_a_clean_environment(tmp_path):
    python = environment(tmp_path / "venv")
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    run(python, "-m", "pip", "install", "--quiet", ROOT)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(f"pip install .: {seconds:.0f} s of processor time")
    _, status, q, _, file = json.loads(run(python, "-c", USE, cwd=tmp_path))
    assert status == "solved" and len(q) == 6 and str(tmp_path) in file


def test_the_wheel_names_its_glibc_and_carries_what_a_machine_need_not_have(wheel):
    assert re.fullmatch(r"steadyhand-[\d.]+-cp3\d+-(cp3\d+|abi3)-manylinux_2_\d+_x86_64\.whl", wheel.name)
    assert wheel.name.split("-")[-1].removesuffix(".whl") in (ROOT / "docs/how-to/use-the-library.md").read_text()
    assert wheel.stat().st_size < 40e6
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        levels = ("", "glibc-hwcaps/x86-64-v3/", "glibc-hwcaps/x86-64-v4/")
        assert {n for n in names if re.search("libsteadyhand_hot", n)} == {f"steadyhand/lib/{level}libsteadyhand_hot.so.{VERSION}" for level in levels}
        for library in ("urdfdom_model", "tinyxml2", "yaml-cpp", "fmt", "zstd", "ssl", "qrencode", "assimp", "ddsc"):
            assert any(re.match(rf"steadyhand\.libs/lib{library}-\w+\.so", name) for name in names), library
        assert [n for n in names if re.search("mujoco|libav|libsw|libEGL|libGL|x264", n)] == []
        for name in ("bin/steadyhand", "py.typed", "_native.pyi", "share/steadyhand/robots/ur5e.yaml", "share/steadyhand/profiles/waiter.yaml"):
            assert f"steadyhand/{name}" in names
        assert len([n for n in names if re.match("steadyhand/share/licenses/.", n)]) == 15
        assert [n for n in names if "nanobind" in n or n.endswith((".a", ".hpp", ".o"))] == []
        needle = str(ROOT).encode()
        assert [n for n in names if needle in archive.read(n)] == []  # no checkout's path is baked in


def test_the_wheel_works_elsewhere_on_every_level(wheel, tmp_path):
    python = environment(tmp_path / "venv")
    run(python, "-m", "pip", "install", "--quiet", wheel)
    bare = {"PATH": str(python.parent), "HOME": str(tmp_path)}  # no compiler, no tool of the system's
    answers = {}
    for level, mask in LEVELS.items():
        if host_can(level):
            masked = {**bare, "GLIBC_TUNABLES": f"glibc.cpu.hwcaps={mask}"} if mask else bare
            answers[level] = json.loads(run(python, "-c", USE, cwd=tmp_path, env=masked))
            assert answers[level][:2] == [level, "solved"]
    assert "x86-64-v2" in answers
    for answer in answers.values():
        assert max(abs(a - b) for a, b in zip(answer[2], answers["x86-64-v2"][2])) < 1e-9
    for command in ([python.parent / "steadyhand"], [python, "-m", "steadyhand"]):
        described = run(*command, "describe", "ur5e", cwd=tmp_path, env=bare)
        assert "built in: ur ros2 mujoco cameras fit page" in run(*command, "--version", cwd=tmp_path, env=bare)
        assert json.loads(described)["name"] == "ur5e"
        refused = subprocess.run([*command, "replay", "nowhere.csv"], capture_output=True, text=True, cwd=tmp_path, env=bare)
        assert (refused.returncode, refused.stderr) == (2, "steadyhand: nowhere.csv: no such file\n")
    hand = "t,px,py,pz,qx,qy,qz,qw\n" + "".join(f"{i / 90},0,{0.001 * i},0,0,0,0,1\n" for i in range(180))
    (tmp_path / "hand.csv").write_text(hand)
    run(python.parent / "steadyhand", "replay", "hand.csv", "--profile", "waiter", cwd=tmp_path, env=bare)
    assert (tmp_path / "out/waiter/plan.csv").exists() and (tmp_path / "out/report.html").exists()


def test_the_tests_of_the_program_pass_with_that_of_the_wheel(wheel, tmp_path):
    python = environment(tmp_path / "venv")
    run(python, "-m", "pip", "install", "--quiet", wheel)
    files = [ROOT / f"tests/python/test_{name}.py" for name in ("describe", "lan", "replay", "sessions")]
    program = {**os.environ, "STEADYHAND_PROGRAM": str(python.parent / "steadyhand")}
    run(sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-m", "not long", *files, env=program)


def test_the_examples_run_with_the_installed_package(wheel, tmp_path):
    python = environment(tmp_path / "venv")
    run(python, "-m", "pip", "install", "--quiet", wheel, "matplotlib")
    code = re.findall(r"```python\n(.*?)```", (ROOT / "docs/how-to/use-the-library.md").read_text(), re.DOTALL)[0]
    run(python, "-c", code, cwd=tmp_path, env={**CLEAN, "MPLBACKEND": "agg"})
    assert (tmp_path / "circle.png").stat().st_size > 10_000


@NEEDED
def test_a_bare_debian_moves_an_arm(wheel, tmp_path):
    """From the file to an arm that follows a hand, and a served page. What pip would download is in the same folder."""
    debian = BareDebian(tmp_path / "debian", "python3-venv")
    run(BASE, "-m", "pip", "download", "--quiet", "--dest", debian.folder / "tmp/wheels", wheel)
    start = time.monotonic()
    install = "python3 -m venv /opt/arm && /opt/arm/bin/pip install --quiet --no-index --find-links /tmp/wheels /tmp/wheels/steadyhand-*.whl"
    done = debian.run("sh", "-c", f"cd /tmp && {install} && exec /opt/arm/bin/steadyhand demo --headless --no-recording --seconds 5")
    print(f"from pip install to the end of 5 s of motion: {time.monotonic() - start:.1f} s")
    assert done.returncode == 0 and "nothing spilled" in done.stdout, done
    page = debian.run("sh", "-c", PAGE)
    assert page.returncode == 0, page
