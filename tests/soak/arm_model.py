"""Distances inside the arm, by kinematics of our own: spheres from the recording's metadata, and the UR5e's meshes."""

import sys
from pathlib import Path

import numpy as np

BLOCK = 2000  # configurations at a time: memory


def link_poses(robot, q):
    """(M, joints + 1, 4, 4) in link 0, for q (M, joints)."""
    poses = np.empty((len(q), len(robot["joints"]) + 1, 4, 4))
    poses[:, 0] = np.eye(4)
    for k, joint in enumerate(robot["joints"]):
        axis = np.array(joint["axis"], dtype=float)
        motion = np.tile(np.eye(4), (len(q), 1, 1))
        if joint["type"] == "revolute":
            cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
            s, c = np.sin(q[:, k])[:, None, None], np.cos(q[:, k])[:, None, None]
            motion[:, :3, :3] = np.eye(3) + s * cross + (1 - c) * (cross @ cross)  # Rodrigues
        else:
            motion[:, :3, 3] = q[:, k, None] * axis
        poses[:, k + 1] = poses[:, k] @ np.array(joint["origin"], dtype=float) @ motion
    return poses


def smallest_sphere_gaps(robot, q):
    """Of the nearest pair at each configuration: gap in m (M,), and which pair (M,)."""
    link = np.array([s["link"] for s in robot["spheres"]])
    center = np.array([s["center"] for s in robot["spheres"]], dtype=float)
    radius = np.array([s["radius"] for s in robot["spheres"]], dtype=float)
    first, second = np.array(robot["pairs"]).T
    gaps, pairs = [], []
    for begin in range(0, len(q), BLOCK):
        poses = link_poses(robot, q[begin:begin + BLOCK])[:, link]
        p = np.einsum("msij,sj->msi", poses[..., :3, :3], center) + poses[..., :3, 3]
        gap = np.linalg.norm(p[:, first] - p[:, second], axis=2) - radius[first] - radius[second]
        pairs.append(gap.argmin(axis=1))
        gaps.append(gap.min(axis=1))
    return (np.concatenate(gaps), np.concatenate(pairs)) if gaps else (np.empty(0), np.empty(0, dtype=int))


class Ur5eMeshes:
    """Convex pieces of the UR5e's links, and the gripper and glass of robots/ur5e.yaml as the solids that its head names."""

    def __init__(self, root):
        import coal

        sys.path.insert(0, str(Path(root) / "robots"))
        from arm_geometry import Arm, package_folder

        self.coal = coal
        arm = Arm(package_folder("airo_models") / "arms/ur5e/ur5e.urdf")
        self.solids = []  # link, shape, placement in the link
        for link, parts in enumerate(arm.convex):
            for part in parts:
                points = coal.StdVec_Vec3s()
                points.extend(np.asarray(p, dtype=float) for p in part.vertices)
                self.solids.append((link, coal.Convex.convexHull(points, False, "Qt"), np.eye(4)))
        along_y = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0.15], [0, 0, 0, 1]])
        for shape, placement in ((coal.Cylinder(0.045, 0.10), at(0, 0, 0.05)), (coal.Cylinder(0.035, 0.11), along_y),
                                 (coal.Box(0.015, 0.025, 0.065), at(0.0425, 0, 0.1325)),
                                 (coal.Box(0.015, 0.025, 0.065), at(-0.0425, 0, 0.1325))):
            self.solids.append((6, shape, placement))
        links = [solid[0] for solid in self.solids]
        # Neighbours touch at their joint; wrist 1 and 3 are a hand's breadth apart at most, whatever the angles.
        self.pairs = [(i, j) for i in range(len(links)) for j in range(i) if abs(links[i] - links[j]) > 1]

    def smallest_gap(self, poses):
        """m, between solids of links that are not neighbours, for the poses (7, 4, 4) of the links; stops at contact."""
        placed = []
        for link, _, placement in self.solids:
            pose = poses[link] @ placement
            placed.append(self.coal.Transform3s(pose[:3, :3], pose[:3, 3]))
        smallest = np.inf
        request, result = self.coal.DistanceRequest(), self.coal.DistanceResult()
        for i, j in self.pairs:
            result.clear()
            gap = self.coal.distance(self.solids[i][1], placed[i], self.solids[j][1], placed[j], request, result)
            smallest = min(smallest, gap)
        return smallest


def at(x, y, z):
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose
