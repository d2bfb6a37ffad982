"""Robots with two arms: described, solved for by both solvers."""

import json
import subprocess

import numpy as np
import pytest

from places import PROGRAM

NODES = 8
WEIGHTS = {"position": 500, "orientation": 5, "velocity": 0.1, "acceleration": 0.02}


def run(*arguments):
    return subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, timeout=120)


def turned(axis, angle):
    K = np.cross(np.eye(3), axis)
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def links_at(robot, q):
    links = [np.eye(4)]
    for joint, value in zip(robot["joints"], q, strict=True):
        motion = np.eye(4)
        if joint.get("type") == "prismatic":
            motion[:3, 3] = value * np.array(joint["axis"])
        else:
            motion[:3, :3] = turned(joint["axis"], value)
        links.append(links[joint["parent"]] @ np.array(joint["origin"]) @ motion)
    return links


@pytest.fixture(scope="module")
def robot():
    return json.loads(run("describe", "two_ur5e").stdout)


def gaps(robot, q):
    """Of all pairs of spheres, m, and whether each is between the arms."""
    links = links_at(robot, q)
    bodies = robot["bodies"]
    centers = np.array([(links[body["link"]] @ np.array(body["origin"]))[:3, 3] for body in bodies])
    radii = np.array([body["radius"] if body["shape"] == "sphere" else np.nan for body in bodies])
    right = np.array([body["link"] > 6 for body in bodies])
    first, second = np.array(robot["pairs"]).T
    apart = np.linalg.norm(centers[first] - centers[second], axis=1) - radii[first] - radii[second]
    spheres = np.isfinite(apart)
    return apart[spheres], (right[first] != right[second])[spheres]


def hands_that_meet(robot, count):
    """Problems whose references take both tools towards each other."""
    random = np.random.default_rng(1)
    problems = []
    for _ in range(count):
        q = np.array(robot["home"]) + 0.1 * random.standard_normal(len(robot["joints"]))
        q = np.clip(q, robot["position_min"], robot["position_max"])
        links = links_at(robot, q)
        poses = [links[tool["link"]] @ np.array(tool["origin"]) for tool in robot["tools"]]
        middle = sum(X[:3, 3] for X in poses) / len(poses)
        tools = [
            {
                "reference": [
                    {"p": list(X[:3, 3] + (middle - X[:3, 3]) * (k + 1) / NODES), "R": X[:3, :3].tolist()}
                    for k in range(NODES)
                ]
            }
            for X in poses
        ]
        x0 = [*q, *np.zeros(len(q))]
        problems.append(
            {"robot": robot["name"], "dt": 0.05, "horizon": NODES, "x0": x0, "weights": WEIGHTS, "tools": tools}
        )
    return problems


def solve(problems, path, *options):
    path.write_text(json.dumps(problems))
    done = run("solve", str(path), *options)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_each_arm_has_its_tool(robot):
    assert [tool["name"] for tool in robot["tools"]] == ["left", "right"]
    assert [tool["link"] for tool in robot["tools"]] == [6, 12] and len(robot["joints"]) == 12
    assert [joint["parent"] for joint in robot["joints"]] == [0, 1, 2, 3, 4, 5, 0, 7, 8, 9, 10, 11]


def test_arms_keep_apart_where_hands_meet_as_fatrop_finds(robot, tmp_path):
    problems = hands_that_meet(robot, 12)
    ours, reference = (solve(problems, tmp_path / "p.json", "--solver", name) for name in ("realtime", "fatrop"))
    nearest, compared = np.inf, 0
    for mine, theirs in zip(ours, reference, strict=True):
        assert mine["status"] == "solved"
        if theirs["status"] == "solved":  # it gives up on some
            assert mine["objective"] == pytest.approx(theirs["objective"], rel=1e-5)
            compared += 1
        for x in mine["x"][1:]:
            apart, between = gaps(robot, x[:12])
            assert apart.min() > -1e-6
            nearest = min(nearest, apart[between].min())
    assert compared >= 8
    assert nearest < 1e-3  # or nothing would have held them apart


@pytest.mark.parametrize("name", ["two_ur5e", "tiago_pro"])
def test_given_joints_keep_still_as_fatrop_finds(tmp_path, name):
    robot = json.loads(run("describe", name).stdout)
    chain, link = [], robot["tools"][1]["link"]
    while link > 0 and len(chain) < 6:
        chain.append(link - 1)
        link = robot["joints"][link - 1]["parent"]
    problems = hands_that_meet(robot, 6)
    for problem in problems:
        problem["given"] = sorted(chain)
    ours, reference = (solve(problems, tmp_path / "p.json", "--solver", name) for name in ("realtime", "fatrop"))
    compared = 0
    for problem, mine, theirs in zip(problems, ours, reference, strict=True):
        assert mine["status"] == "solved"
        assert not np.array(mine["u"])[:, chain].any() and not np.array(theirs["u"])[:, chain].any()
        assert np.array(mine["u"]).any()
        assert all(x[j] == problem["x0"][j] for x in mine["x"] for j in chain)
        if theirs["status"] == "solved":
            assert mine["objective"] == pytest.approx(theirs["objective"], rel=1e-5)
            compared += 1
    assert compared >= 4


@pytest.mark.parametrize(
    "change, says",
    [
        (lambda p: p.update(given=[12]), "'given[0]' must be within 0 and 11, not 12"),
        (lambda p: p.update(robot="ur5e", x0=[0] * 12), "has references for 2 tools; robot 'ur5e' has 1"),
        (lambda p: p.update(p["tools"].pop()), "'tools' has 1 entries; it must have 2"),
        (lambda p: p["weights"].update(position=[1, 2]), "'position' has 2 numbers, it needs 1 or 6"),
    ],
)
def test_bad_problems_are_refused(robot, tmp_path, change, says):
    [problem] = hands_that_meet(robot, 1)
    change(problem)
    (tmp_path / "p.json").write_text(json.dumps(problem))
    done = run("solve", str(tmp_path / "p.json"))
    assert done.returncode == 2 and says in done.stderr
