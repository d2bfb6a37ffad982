"""The shipped bodies of the UR5e cover arm, gripper and glass, call no contact free, and waste little: the balls of ur5e.yaml
and what `fit` found for ur5e_fitted.yaml. How that is proven stands in test_fit.py."""

import itertools

import numpy as np
import pytest
import steadyhand
from test_fit import LINKS, TOOL, Ur5e, core_of, depth, judged, shipped_bodies, uncovered, without_tool

# Share of the truly free configurations that the arm's own bodies refuse: 14.2 % and 1.3 % measured. The 8 balls on the cable
# under the base, which the fitted bodies leave out, make up 10 % of the first.
REFUSED_AT_MOST = {"ur5e": 0.155, "ur5e_fitted": 0.015}
both = pytest.mark.parametrize("name", list(REFUSED_AT_MOST))


@pytest.fixture(scope="module")
def ur5e():
    return Ur5e()


@both
def test_each_link_lies_in_its_bodies(ur5e, name):
    for link, parts, visual in zip(LINKS, ur5e.meshes, ur5e.visuals):
        bodies = [core_of(body) for body in shipped_bodies(name) if body["link"] == link and not body["name"].startswith(TOOL)]
        for vertices, triangles in [*parts, *([visual] if name == "ur5e" else [])]:
            left = uncovered(vertices[triangles], bodies)
            assert len(left) == 0, f"{link}: at {left[0].mean(axis=0)}"
        smaller = [(center, axes, half, radius - 2e-3) for center, axes, half, radius in bodies]
        assert any(len(uncovered(vertices[triangles], smaller)) for vertices, triangles in parts), f"{link}: the check cannot fail"


@both
def test_no_contact_is_called_free(ur5e, tmp_path, name):
    free, refused, missed = judged(ur5e, without_tool(name, tmp_path), 4000, 8)
    print(f"\nfree {free:.2%}, of these refused {refused:.2%}")
    assert missed == 0 and 0.5 < free < 1.0
    assert refused < REFUSED_AT_MOST[name]


@both
def test_gripper_and_glass_are_covered(name):
    """The solids that the heads of both files document."""
    rng = np.random.default_rng(3)
    angle, height, share = rng.uniform(0, 2 * np.pi, 20000), rng.uniform(-1, 1, 20000), np.sqrt(rng.uniform(0, 1, 20000))
    share[::2] = 1.0
    x, y = share * np.cos(angle), share * np.sin(angle)
    height[1::2] = np.sign(height[1::2])
    body = np.column_stack([0.045 * x, 0.045 * y, 0.05 + 0.05 * height])
    glass = np.column_stack([0.035 * x, 0.055 * height, 0.15 + 0.035 * y])
    corners = np.array(list(itertools.product((-1, 1), repeat=3)))
    fingers = [corners * [0.0075, 0.0125, 0.0325] + [x, 0, 0.1325] for x in (-0.0425, 0.0425)]
    bodies = [core_of(body) for body in shipped_bodies(name) if body["name"].startswith(TOOL)]
    assert depth(bodies, np.vstack([body, glass, *fingers])).min(axis=0).max() <= 1e-9


def test_home_is_upright_in_front_and_has_room():
    robot = steadyhand.Robot("ur5e")
    glass = robot.fk(robot.home)
    np.testing.assert_allclose(glass[:3, 3], [0.55, 0.0, 0.40], atol=1e-3)
    np.testing.assert_allclose(glass[:3, 2], [0, 0, 1], atol=1e-6)
    assert robot.clearance(robot.home) >= 0.01
    near = robot.home + np.random.default_rng(4).uniform(-0.5, 0.5, (4000, 6))
    assert np.mean([robot.clearance(q) > 0 for q in near]) > 0.95
