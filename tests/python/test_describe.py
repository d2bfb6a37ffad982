"""`steadyhand describe` and what the program says to a bad command line."""

import json
import os
import re
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
import yaml

from places import PROGRAM, ROOT


def run(*arguments, **options):
    return subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, timeout=60, **options)


@pytest.fixture(scope="module")
def robot():
    done = run("describe", "ur5e")
    assert (done.returncode, done.stderr) == (0, "")
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def settings():
    return yaml.safe_load((ROOT / "robots/ur5e.yaml").read_text())


def urdf_of(settings) -> Path:
    [package] = ROOT.glob(f".deps/venv/lib/python3*/site-packages/{settings['urdf']['package']}")
    return package / settings["urdf"]["path"]


def test_has_the_keys_of_the_formulation_in_order(robot):
    assert list(robot) == [
        "name", "joints", "tools", "home", "position_min", "position_max", "velocity_max", "acceleration_max",
        "spheres", "bodies", "pairs",
    ]  # fmt: skip
    n = len(robot["joints"])
    assert n == 6
    for k, joint in enumerate(robot["joints"]):
        assert {"name", "origin", "axis"} <= joint.keys() and joint["parent"] == k
    for key in ("home", "position_min", "position_max", "velocity_max", "acceleration_max"):
        assert np.isfinite(robot[key]).all() and len(robot[key]) == n
    (tool,) = robot["tools"]
    assert tool.keys() == {"name", "link", "origin"} and tool["link"] == n
    for sphere in robot["spheres"]:
        assert sphere.keys() == {"name", "link", "center", "radius"}
        assert 0 <= sphere["link"] <= n and sphere["radius"] > 0 and len(sphere["center"]) == 3


def test_spheres_are_the_bodies(robot):
    assert [b["name"] for b in robot["bodies"]] == [s["name"] for s in robot["spheres"]]
    for body, sphere in zip(robot["bodies"], robot["spheres"], strict=True):
        assert body["shape"] == "sphere" and body["link"] == sphere["link"] and body["radius"] == sphere["radius"]
        assert np.array(body["origin"])[:3, 3].tolist() == sphere["center"]


def test_bodies_of_each_shape(tmp_path, settings):
    (tmp_path / "arm.yaml").write_text(f"""
urdf: {urdf_of(settings)}
bodies:
  - {{name: a, link: base_link_inertia, sphere: {{radius: 0.1}}}}
  - {{name: b, link: forearm_link, capsule: {{from: [0, 0, 0], to: [-0.4, 0, 0], radius: 0.05}}}}
  - {{name: c, link: wrist_2_link, box: {{size: [0.1, 0.2, 0.3], center: [0, 0, 0.1], rpy: [0, 0, 1.5707963267948966], rounding: 0.01}}}}
  - {{name: d, link: wrist_3_link, cylinder: {{from: [0, 0, 0], to: [0, 0.1, 0], radius: 0.04}}}}
""")
    robot = json.loads(run("describe", str(tmp_path / "arm.yaml")).stdout)
    a, b, c, d = robot["bodies"]
    assert robot["spheres"] == [] and [0, 1] in robot["pairs"]
    assert (a["shape"], a["radius"], np.array(a["origin"])[:3, 3].tolist()) == ("sphere", 0.1, [0, 0, 0])
    assert (b["shape"], b["radius"], b["length"]) == ("capsule", 0.05, 0.4)
    origin = np.array(b["origin"])
    assert np.allclose(origin[:3, 3], [-0.2, 0, 0]) and np.allclose(np.abs(origin[:3, 2]), [1, 0, 0])
    assert (c["shape"], c["rounding"]) == ("box", 0.01) and np.allclose(c["size"], [0.1, 0.2, 0.3])
    assert np.allclose(np.array(c["origin"])[:3, :3], [[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    assert (d["shape"], d["radius"], d["length"]) == ("cylinder", 0.04, 0.1)


def test_frames_are_rigid(robot):
    for T in [joint["origin"] for joint in robot["joints"]] + [robot["tools"][0]["origin"]]:
        T = np.array(T)
        assert T.shape == (4, 4) and (T[3] == [0, 0, 0, 1]).all()
        assert np.abs(T[:3, :3] @ T[:3, :3].T - np.eye(3)).max() < 1e-12


def test_agrees_with_the_urdf(robot, settings):
    text = urdf_of(settings).read_text().replace("drake:", "")  # a prefix that the file does not declare
    joints = {j.get("name"): j for j in ET.fromstring(text).iter("joint") if j.get("type") == "revolute"}
    assert [joint["name"] for joint in robot["joints"]] == list(joints)
    for k, joint in enumerate(robot["joints"]):
        urdf = joints[joint["name"]]
        limit = urdf.find("limit")
        assert robot["position_min"][k] == float(limit.get("lower"))
        assert robot["position_max"][k] == float(limit.get("upper"))
        assert robot["velocity_max"][k] == float(limit.get("velocity"))
        assert joint["axis"] == [float(x) for x in urdf.find("axis").get("xyz").split()]
        if k > 0:  # before joint 0 stands base_link_inertia, half a turn about z
            xyz = [float(x) for x in urdf.find("origin").get("xyz").split()]
            assert np.abs(np.array(joint["origin"])[:3, 3] - xyz).max() < 1e-12


def test_agrees_with_the_robot_file(robot, settings):
    assert robot["home"] == settings["home"]
    assert robot["acceleration_max"] == settings["acceleration_max"]
    for sphere, written in zip(robot["spheres"], settings["spheres"], strict=True):
        assert sphere["name"] == written["name"]
        assert sphere["radius"] == written["radius"]
        if sphere["link"] > 0:  # the URDF's own frame of that link
            assert sphere["center"] == written["center"]


def test_pairs_are_on_links_that_are_no_neighbours(robot):
    links = [sphere["link"] for sphere in robot["spheres"]]
    pairs = [tuple(pair) for pair in robot["pairs"]]
    assert len(set(pairs)) == len(pairs) > 0
    assert all(links[j] - links[i] > 1 for i, j in pairs)


def test_pretty_says_the_same(robot):
    done = run("describe", "ur5e", "--pretty")
    assert done.stdout.count("\n") > 100
    assert json.loads(done.stdout) == robot


def test_runs_from_any_folder(tmp_path, robot):
    assert json.loads(run("describe", "ur5e", cwd=tmp_path).stdout) == robot


def test_does_not_depend_on_the_locale(robot):
    done = run("describe", "ur5e", env={**os.environ, "LC_ALL": "de_DE.UTF-8"})
    assert json.loads(done.stdout) == robot


@pytest.mark.parametrize(
    "arguments, said",
    [
        ([], "a command is expected"),
        (["descrbe"], "unknown command 'descrbe'; did you mean 'describe'?"),
        (["describe"], "robot is required"),
        (["describe", "ur55"], "'ur55' is neither a file nor one of the names in robots/: fr3"),
        (["describe", "no/such/arm.urdf"], "'no/such/arm.urdf'"),
        (["describe", "ur5e", "more"], "more"),
        (["describe", "ur5e", "--fast"], "--fast"),
        (["--fast"], "--fast"),
    ],
)
def test_bad_command_lines(arguments, said):
    done = run(*arguments)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("steadyhand: ") and said in done.stderr


def test_a_bad_urdf(tmp_path):
    file = tmp_path / "arm.urdf"
    file.write_text('<robot name="arm"><link name="a"/></robot>')
    done = run("describe", str(file))
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr == (
        f"steadyhand: {file}: the chain from 'a' to 'a' has 0 moving joints; an arm has 1 to 16\n"
    )


def test_a_full_disk_is_told():
    with open("/dev/full", "w") as full:
        done = subprocess.run([PROGRAM, "describe", "ur5e"], stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 2 and "cannot write" in done.stderr


def test_help_shows_every_command_with_examples():
    done = run("--help")
    assert done.returncode == 0
    for command in ("demo", "replay", "describe", "solve", "study", "dataset", "score", "policy"):
        assert f"  steadyhand {command} " in done.stdout


def test_the_version_names_commit_processor_and_parts():
    lines = run("--version").stdout.splitlines()
    for line, form in zip(lines, [r"steadyhand \d+\.\d+\.\d+", r"commit ([0-9a-f]{7,40}(-dirty)?|unknown)", r"processor (x86-64(-v[234])?|aarch64|generic)", r"built in:[\w ]+"], strict=True):
        assert re.fullmatch(form, line)
    if (ROOT / ".git").exists():
        assert "unknown" not in lines[1]
    parts, commands = lines[3].split()[2:], run("--help").stdout
    for part, command in (("ur", "check"), ("fit", "fit"), ("mujoco", "tasks")):
        assert (part in parts) == (re.search(rf"^  {command} ", commands, re.MULTILINE) is not None)
