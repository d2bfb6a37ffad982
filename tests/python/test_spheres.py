"""The spheres of robots/ur5e.yaml: they cover arm, gripper and glass, refuse every true collision and waste little.

Kinematics and the placement of meshes come from Pinocchio, collisions from coal; nothing of robots/*.py is used here.
"""

import importlib.util
import itertools
import json
import os
import subprocess
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin
import pytest
import yaml
from scipy.spatial import ConvexHull, cKDTree
from scipy.spatial.transform import Rotation

ROOT = Path(os.environ.get("STEADYHAND_ROOT", Path(__file__).parents[2]))
LINKS = ["base_link_inertia", "shoulder_link", "upper_arm_link", "forearm_link"]
LINKS += ["wrist_1_link", "wrist_2_link", "wrist_3_link"]
CONVEX_PARTS = [["base"], ["shoulder"], [f"upper_arm_link_part_{i}" for i in range(3)]]
CONVEX_PARTS += [[f"forearm_link_part_{i}" for i in range(3)], ["wrist1"], ["wrist2"], ["wrist3"]]
ARM_SPHERES = 29
# Share of the truly free configurations that the arm's spheres refuse: 14.2 % measured. The 8 spheres on the cable
# under the base, which is part of the visual mesh but not of the truth, make up 10 of these. One sigma is 0.4 %.
SHARE_BOUND = 0.155


class Ur5e:
    """Robot file, Pinocchio's model, meshes in link frames and the spheres as arrays."""

    def __init__(self):
        self.file = yaml.safe_load((ROOT / "robots/ur5e.yaml").read_text())
        urdf = self.file["urdf"]
        package = Path(importlib.util.find_spec(urdf["package"]).submodule_search_locations[0])
        path = package / urdf["path"]
        self.model = pin.buildModelFromUrdf(str(path))
        assert [joint.shortname() for joint in self.model.joints[1:]] == ["JointModelRZ"] * 6
        self.data = self.model.createData()
        visuals = pin.buildGeomFromUrdf(self.model, str(path), pin.GeometryType.VISUAL, package_dirs=[str(path.parent)])
        self.visuals = [[] for _ in LINKS]
        self.convex = [[] for _ in LINKS]
        for shape in visuals.geometryObjects:
            frame = self.model.frames[shape.parentFrame]
            placement = frame.placement.inverse() * shape.placement
            link = LINKS.index(frame.name)
            vertices, triangles = read_obj(shape.meshPath)
            # Pinocchio reads the same points, less a few that it joins or that no face uses; but with several materials
            # in a file it mixes the triangles' indices up, so that the file itself is read for them.
            loaded = np.array(shape.geometry.vertices())
            assert cKDTree(vertices).query(loaded)[0].max() < 1e-6 and len(loaded) > 0.999 * len(vertices)
            self.visuals[link].append((moved(vertices, placement), triangles))
            # The convex parts are modelled in the frame of the visual mesh.
            for part in CONVEX_PARTS[link]:
                vertices, triangles = read_obj(path.parent / "collision" / f"{part}.obj")
                self.convex[link].append((moved(vertices, placement), triangles))
        spheres = self.file["spheres"]
        self.names = [sphere["name"] for sphere in spheres]
        self.link = np.array([LINKS.index(sphere["link"]) for sphere in spheres])
        self.center = np.array([sphere["center"] for sphere in spheres], dtype=float)
        self.radius = np.array([sphere["radius"] for sphere in spheres], dtype=float)
        self.pairs = self.pairs_by_the_rule()

    def link_poses(self, q):
        """(M, 7, 4, 4) in link 0, for q (M, 6)."""
        poses = np.empty((len(q), 7, 4, 4))
        base = self.model.frames[self.model.getFrameId(LINKS[0])].placement
        poses[:, 0] = np.eye(4)
        pose = np.tile(base.inverse().homogeneous, (len(q), 1, 1))
        for k in range(6):
            turn = np.tile(np.eye(4), (len(q), 1, 1))
            c, s = np.cos(q[:, k]), np.sin(q[:, k])
            turn[:, 0, 0], turn[:, 0, 1], turn[:, 1, 0], turn[:, 1, 1] = c, -s, s, c
            pose = pose @ self.model.jointPlacements[k + 1].homogeneous @ turn
            poses[:, k + 1] = pose
        return poses

    def sphere_centers(self, q):
        """(M, S, 3) in link 0."""
        poses = self.link_poses(q)[:, self.link]
        return np.einsum("nsij,sj->nsi", poses[..., :3, :3], self.center) + poses[..., :3, 3]

    def clearances(self, q, spheres=None):
        """||c_i - c_j|| - r_i - r_j of the pairs among the first `spheres` spheres, (M, P)."""
        first, second = self.pairs[(self.pairs < (spheres or len(self.names))).all(axis=1)].T
        blocks = []
        for block in np.array_split(q, len(q) // 1000 + 1):
            c = self.sphere_centers(block)
            blocks.append(np.linalg.norm(c[:, first] - c[:, second], axis=2) - self.radius[first] - self.radius[second])
        return np.vstack(blocks)

    def pairs_by_the_rule(self):
        """Pairs on links that are neither the same nor neighbours and that can be apart at some joint angles."""
        candidates = np.array(
            [
                (i, j)
                for i, j in itertools.combinations(range(len(self.names)), 2)
                if abs(self.link[i] - self.link[j]) > 1
            ]
        )
        return candidates[self.largest_distances(candidates) > self.radius[candidates].sum(axis=1)]

    def largest_distances(self, pairs, starts=3, rounds=4):
        """Largest distance of each pair's centres. Along one joint the squared distance is A + B cos q + C sin q:
        three values give its maximum in closed form, and joint after joint climbs to the pair's.
        No joint of the UR5e is limited to less than a full turn."""
        assert (self.model.upperPositionLimit - self.model.lowerPositionLimit >= 2 * np.pi - 1e-9).all()
        rng = np.random.default_rng(11)
        first, second = np.tile(pairs, (starts, 1)).T
        row = np.arange(len(first))
        q = rng.uniform(-np.pi, np.pi, (len(first), 6))

        def squared():
            c = self.sphere_centers(q)
            return ((c[row, first] - c[row, second]) ** 2).sum(axis=1)

        for joint in list(range(6)) * rounds:
            values = []
            for angle in (0.0, 2 * np.pi / 3, 4 * np.pi / 3):
                q[:, joint] = angle
                values.append(squared())
            v0, v1, v2 = values
            q[:, joint] = np.arctan2((v1 - v2) / np.sqrt(3), (2 * v0 - v1 - v2) / 3)
        return np.sqrt(squared().reshape(starts, -1).max(axis=0))


def read_obj(path):
    """Vertices and triangles of an OBJ file whose faces are all triangles."""
    lines = [line.split() for line in Path(path).read_text().splitlines()]
    faces = [[int(corner.split("/")[0]) - 1 for corner in line[1:]] for line in lines if line and line[0] == "f"]
    assert {len(face) for face in faces} == {3}, path
    return np.array([line[1:4] for line in lines if line and line[0] == "v"], dtype=float), np.array(faces)


def moved(vertices, placement):
    return vertices @ placement.rotation.T + placement.translation


def uncovered(corners, center, radius, finest=2e-5):
    """Triangles (K, 3, 3) that the union of balls may leave uncovered.

    A triangle whose corners share a ball lies in it; any other is cut into four, down to `finest` (m).
    """
    left = []
    while len(corners):
        inside = np.linalg.norm(corners[:, :, None] - center, axis=3) <= radius
        corners = corners[~inside.all(axis=1).any(axis=1)]
        bad = ~inside.any(axis=2).all(axis=1)
        bad = bad[~inside.all(axis=1).any(axis=1)]
        small = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1, initial=0.0) < finest
        left.append(corners[bad | small])
        a, b, c = corners[~(bad | small)].transpose(1, 0, 2)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        corners = np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return np.concatenate(left) if left else corners


@pytest.fixture(scope="module")
def robot():
    return Ur5e()


def test_29_spheres_on_the_arm_and_few_on_the_tool(robot):
    assert len(set(robot.names)) == len(robot.names)
    tool = [name.startswith(("gripper", "glass")) for name in robot.names]
    assert sum(tool) == 4 and tool == sorted(tool), "the arm's spheres come first"
    assert len(robot.names) - sum(tool) == ARM_SPHERES
    assert set(robot.link[:ARM_SPHERES]) == set(range(7))
    assert (robot.radius > 0.005).all()


@pytest.mark.parametrize("link", range(7), ids=LINKS)
def test_spheres_cover_the_visual_meshes(robot, link):
    own = np.flatnonzero(robot.link[:ARM_SPHERES] == link)
    assert robot.visuals[link]
    for vertices, triangles in robot.visuals[link] + robot.convex[link]:
        distance = np.linalg.norm(vertices[:, None] - robot.center[own], axis=2) - robot.radius[own]
        assert distance.min(axis=1).max() <= 0.0
        left = uncovered(vertices[triangles], robot.center[own], robot.radius[own])
        assert len(left) == 0, f"{len(left)} pieces of triangles stick out, the first at {left[0].mean(axis=0)}"


def test_the_cover_check_can_fail(robot):
    own = np.flatnonzero(robot.link[:ARM_SPHERES] == 3)
    vertices, triangles = robot.visuals[3][0]
    for sphere in own:
        radius = robot.radius[own] - np.where(own == sphere, 2e-3, 0.0)
        assert len(uncovered(vertices[triangles], robot.center[own], radius)) > 0, robot.names[sphere]


def tool_surface(rng):
    """Points on the solids that the head of robots/ur5e.yaml documents, in the frame of wrist_3_link."""
    angle, height, share = rng.uniform(0, 2 * np.pi, 20000), rng.uniform(-1, 1, 20000), rng.uniform(0, 1, 20000)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    end = np.sign(height)
    body = np.column_stack([0.045 * ring, 0.05 + 0.05 * height])
    body_ends = np.column_stack([0.045 * np.sqrt(share)[:, None] * ring, 0.05 + 0.05 * end])
    glass = np.column_stack([0.035 * ring[:, 0], 0.055 * height, 0.15 + 0.035 * ring[:, 1]])
    disc = 0.035 * np.sqrt(share)[:, None] * ring
    glass_ends = np.column_stack([disc[:, 0], 0.055 * end, 0.15 + disc[:, 1]])
    corners = np.array(list(itertools.product((-1, 1), repeat=3)))
    boxes = rng.uniform(-1, 1, (20000, 3))
    fingers = [np.vstack([corners, boxes]) * [0.0075, 0.0125, 0.0325] + [x, 0, 0.1325] for x in (-0.0425, 0.0425)]
    return np.vstack([body, body_ends, glass, glass_ends, *fingers])


def test_gripper_and_glass_are_covered(robot):
    points = tool_surface(np.random.default_rng(3))
    own = slice(ARM_SPHERES, None)
    assert (robot.link[own] == 6).all()
    outside = np.linalg.norm(points[:, None] - robot.center[own], axis=2) - robot.radius[own]
    assert outside.min(axis=1).max() <= 0.0


def test_tool_frame_is_the_glass(robot):
    tool = robot.file["tool"]
    assert tool["link"] == LINKS[6]
    np.testing.assert_allclose(tool["xyz"], [0, 0, 0.15])
    np.testing.assert_allclose(Rotation.from_euler("xyz", tool["rpy"]).apply([0, 0, 1]), [0, 1, 0], atol=1e-12)


def test_home_is_upright_in_front_and_has_room(robot):
    q = np.array(robot.file["home"])
    tool = robot.file["tool"]
    pin.framesForwardKinematics(robot.model, robot.data, q)
    wrist = robot.data.oMf[robot.model.getFrameId(LINKS[6])]
    glass = wrist * pin.SE3(Rotation.from_euler("xyz", tool["rpy"]).as_matrix(), np.array(tool["xyz"]))
    np.testing.assert_allclose(glass.translation, [0.55, 0.0, 0.40], atol=1e-3)
    np.testing.assert_allclose(glass.rotation[:, 2], [0, 0, 1], atol=1e-6)
    jacobian = pin.computeFrameJacobian(robot.model, robot.data, q, robot.model.getFrameId(LINKS[6]))
    assert np.linalg.svd(jacobian)[1].min() > 0.1

    # The links on both sides of one joint pass each other as closely as the arm is built, at home and anywhere else.
    clear = robot.clearances(q[None])[0]
    always_close = np.abs(np.diff(robot.link[robot.pairs]))[:, 0] == 2
    assert clear[~always_close].min() >= 0.02
    assert clear[always_close].min() >= 0.01
    near = q + np.random.default_rng(4).uniform(-0.5, 0.5, (4000, 6))
    assert (robot.clearances(near).min(axis=1) > 0).mean() > 0.95


def test_vectorised_kinematics_agree_with_pinocchio(robot):
    for q in np.random.default_rng(5).uniform(-np.pi, np.pi, (20, 6)):
        pin.framesForwardKinematics(robot.model, robot.data, q)
        poses = [robot.data.oMf[robot.model.getFrameId(name)] for name in LINKS]
        expected = np.array([(poses[0].inverse() * pose).homogeneous for pose in poses])
        np.testing.assert_allclose(robot.link_poses(q[None])[0], expected, atol=1e-12)


def test_convex_parts_are_the_visual_bodies(robot):
    for link in range(7):
        vertices = np.vstack([mesh[0] for mesh in robot.visuals[link]])
        if link == 0:  # the wheel has no collision mesh of the cable, which hangs from the base's edge
            vertices = vertices[(vertices[:, 2] >= 0) & (np.hypot(vertices[:, 0], vertices[:, 1]) < 0.0757)]
        parts = [ConvexHull(mesh[0]).equations for mesh in robot.convex[link]]
        outside = np.min([(vertices @ part[:, :3].T + part[:, 3]).max(axis=1) for part in parts], axis=0)
        assert outside.max() < 3e-3
        corners = np.vstack([mesh[0] for mesh in robot.convex[link]])
        assert cKDTree(vertices).query(corners)[0].max() < 0.02


class Truth:
    """Collision of the convex parts on links that are neither the same nor neighbours."""

    def __init__(self, robot):
        self.robot = robot
        self.shapes = [[convex_shape(*mesh) for mesh in meshes] for meshes in robot.convex]
        self.request = coal.CollisionRequest()

    def collides(self, q):
        return np.array([self.collides_at(poses) for poses in self.robot.link_poses(q)])

    def collides_at(self, poses):
        transforms = [coal.Transform3s(pose[:3, :3], pose[:3, 3]) for pose in poses]
        for a, b in itertools.combinations(range(7), 2):
            for shape_a, shape_b in itertools.product(self.shapes[a], self.shapes[b]) if b > a + 1 else ():
                if coal.collide(shape_a, transforms[a], shape_b, transforms[b], self.request, coal.CollisionResult()):
                    return True
        return False


def convex_shape(vertices, triangles):
    points, faces = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for vertex in vertices:
        points.append(vertex)
    for a, b, c in triangles:
        faces.append(coal.Triangle(int(a), int(b), int(c)))
    return coal.Convex(points, faces)


def test_spheres_refuse_every_true_collision_and_waste_little(robot):
    truth = Truth(robot)
    q = np.random.default_rng(6).uniform(-np.pi, np.pi, (10000, 6))
    colliding = truth.collides(q)
    refused = robot.clearances(q, ARM_SPHERES).min(axis=1) < 0
    assert colliding.any() and not colliding.all()
    assert not (colliding & ~refused).any()

    share = refused[~colliding].mean()
    with_tool = robot.clearances(q).min(axis=1) < 0
    print(f"\ntruly free: {(~colliding).mean():.1%} of {len(q)} configurations, uniform in +-pi")
    print(f"of these the {ARM_SPHERES} spheres of the arm refuse {share:.1%}")
    print(f"with gripper and glass, which the truth knows nothing of, {with_tool[~colliding].mean():.1%}")
    assert share < SHARE_BOUND


def test_spheres_refuse_the_first_touch(robot):
    """Between a free and a colliding configuration, where the true bodies just touch, the spheres already overlap."""
    truth = Truth(robot)
    q = np.random.default_rng(8).uniform(-np.pi, np.pi, (1500, 6))
    colliding = truth.collides(q)
    touching = q[colliding]
    free = q[~colliding][: len(touching)]
    for _ in range(16):
        middle = (free + touching) / 2
        hit = truth.collides(middle)[:, None]
        free, touching = np.where(hit, free, middle), np.where(hit, middle, touching)
    assert len(touching) > 150
    assert (robot.clearances(touching, ARM_SPHERES).min(axis=1) < 0).all()


def distances(points):
    return np.linalg.norm(points[:, None] - points, axis=2)


def test_describe_prints_these_spheres_and_pairs(robot):
    if "STEADYHAND_PROGRAM" not in os.environ:
        pytest.skip("STEADYHAND_PROGRAM is not set")
    command = [os.environ["STEADYHAND_PROGRAM"], "describe", "ur5e"]
    printed = json.loads(subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout)
    assert [sphere["name"] for sphere in printed["spheres"]] == robot.names
    assert [sphere["link"] for sphere in printed["spheres"]] == robot.link.tolist()
    np.testing.assert_allclose([sphere["radius"] for sphere in printed["spheres"]], robot.radius)
    assert sorted(map(tuple, printed["pairs"])) == sorted(map(tuple, robot.pairs.tolist()))

    # The printed centres may be in another frame of link 0; what counts is where the spheres are.
    q = np.random.default_rng(9).uniform(-np.pi, np.pi, (50, 6))
    expected = robot.sphere_centers(q)
    for angles, centers in zip(q, expected):
        pose, placed = np.eye(4), []
        poses = [pose]
        for joint, angle in zip(printed["joints"], angles):
            turn = np.eye(4)
            turn[:3, :3] = Rotation.from_rotvec(angle * np.array(joint["axis"])).as_matrix()
            poses.append(poses[-1] @ np.array(joint["origin"]) @ turn)
        for sphere in printed["spheres"]:
            placed.append((poses[sphere["link"]] @ [*sphere["center"], 1.0])[:3])
        np.testing.assert_allclose(distances(np.array(placed)), distances(centers), atol=1e-8)
