"""MuJoCo, FFmpeg and EGL are loaded when they are first needed, and an error says what to install."""

import os
import re
import subprocess

import pytest

from places import PROGRAM, ROOT

SHARE = PROGRAM.parent / "share/steadyhand"


def demo(*words, **environment):
    command = [PROGRAM, "demo", "--headless", "--no-recording", "--seconds", "0.2", *words]
    variables = {key: value for key, value in os.environ.items() if not key.startswith("STEADYHAND")} | {key: str(value) for key, value in environment.items()}
    return subprocess.run(command, env=variables, capture_output=True, text=True, timeout=120)


def refusal(*words, **environment):
    done = demo(*words, **environment)
    if "was built without" in done.stderr:
        pytest.skip(done.stderr.strip())
    assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stdout + done.stderr
    return done.stderr


@pytest.fixture
def share(tmp_path):
    """The program's data, and of Python packages the robots' alone."""
    (tmp_path / "packages").mkdir()
    for name in ("robots", "cells", "profiles", "tasks", "recordings", "packages/airo_models"):
        (tmp_path / name).symlink_to(SHARE / name)
    return tmp_path


@pytest.fixture
def hidden(tmp_path):
    """Makes a folder in which the loader finds an empty file in place of a library."""

    def make(*names):
        for name in names:
            (tmp_path / name).touch()
        return tmp_path

    return make


def test_none_of_them_is_linked():
    for file in (PROGRAM, *PROGRAM.parent.glob("libsteadyhand_live.so")):
        dynamic = subprocess.run(["readelf", "-d", file], check=True, capture_output=True, text=True).stdout
        needed = re.findall(r"NEEDED.*\[(.*)\]", dynamic)
        assert "libc.so.6" in needed and [name for name in needed if re.match("lib(mujoco|av|sw|EGL)", name)] == []


def test_without_mujoco_everything_else_works(share):
    assert demo(STEADYHAND_DATA=share).returncode == 0
    message = refusal("--arm", "mujoco", STEADYHAND_DATA=share)
    version = re.search(r"mujoco-core==([\d.]+)", (ROOT / "setup/requirements-mujoco.txt").read_text())[1]
    assert f"MuJoCo {version} is not installed: install it with 'pip install mujoco-core=={version}'" in message
    assert f"{share}/packages/mujoco/libmujoco.so.{version}: " in message
    done = subprocess.run([PROGRAM, "tasks", "stack"], env={"STEADYHAND_DATA": str(share)}, capture_output=True, text=True)
    assert done.returncode == 2 and "is not installed" in done.stderr


@pytest.mark.parametrize("number, version, said", [(3002007, "3.2.7", "/libmujoco.so.3.2.7 is MuJoCo 3.2.7, and this program needs 4.0.1: "),
                                                   (4000001, "4.0.1", "/libmujoco.so.4.0.1 does not have mj_camlight, ")])  # fmt: skip
def test_another_library_in_the_place_of_mujoco(share, number, version, said):
    (share / "packages/mujoco").mkdir()
    code = f'int mj_version(void) {{ return {number}; }}\nconst char* mj_versionString(void) {{ return "{version}"; }}\n'
    library = share / f"packages/mujoco/libmujoco.so.{version}"
    subprocess.run(["cc", "-shared", "-fPIC", "-x", "c", "-", "-o", library], input=code, text=True, check=True)
    message = refusal("--arm", "mujoco", STEADYHAND_DATA=share)
    assert said in message and "pip install mujoco-core==4.0.1" in message


@pytest.mark.parametrize("name", ["libavformat", "libavcodec", "libswscale"])
def test_without_ffmpeg_only_cameras_are_refused(hidden, name):
    folder = hidden(*(f"{name}.so.{version}" for version in range(5, 100)))
    assert demo(LD_LIBRARY_PATH=folder).returncode == 0
    message = refusal("--camera", "table=film.mp4", LD_LIBRARY_PATH=folder)
    assert f"cameras need FFmpeg's libraries: {folder}/{name}.so." in message
    assert re.search(rf"'apt install .*{name}\d+", message), message


def test_without_egl_or_a_display_only_cameras_of_scenes_are_refused(hidden):
    scene = ["--arm", "mujoco", "--task", "carry", "--camera"]
    folder = hidden("libEGL.so.1")
    message = refusal(*scene, "front", LD_LIBRARY_PATH=folder)
    assert f"cameras of a simulated scene need EGL: {folder}/libEGL.so.1: " in message and "apt install libegl1" in message
    assert demo(*scene, "none", LD_LIBRARY_PATH=folder).returncode == 0
    assert "EGL has no display without a screen" in refusal(*scene, "front", __EGL_VENDOR_LIBRARY_DIRS=folder)
