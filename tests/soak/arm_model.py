"""Distances inside the arm, by kinematics of our own: bodies from the recording's metadata, and the UR5e's meshes."""

from importlib.util import find_spec
from pathlib import Path

import numpy as np

LINKS = ["base_link_inertia", "shoulder_link", "upper_arm_link", "forearm_link", "wrist_1_link", "wrist_2_link", "wrist_3_link"]
# Convex pieces of what is not convex, by stem of the visual mesh.
FINER = {"upperarm": [f"upper_arm_link_part_{i}" for i in range(3)], "forearm": [f"forearm_link_part_{i}" for i in range(3)],
         "base_cable_labels": ["base"]}  # fmt: skip
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


def smallest_body_gaps(robot, q):
    """Of the nearest pair at each configuration: gap in m (M,), and which pair (M,). Spheres and capsules; of other pairs
    whatever Coal says."""
    bodies, pairs = robot["bodies"], np.array(robot["pairs"])
    link = np.array([b["link"] for b in bodies])
    origin = np.array([b["origin"] for b in bodies], dtype=float)
    radius = np.array([b.get("radius", 0.0) for b in bodies], dtype=float)
    half = np.array([0.5 * b.get("length", 0.0) for b in bodies])
    is_round = np.array([b["shape"] in ("sphere", "capsule") for b in bodies])
    both = is_round[pairs].all(axis=1)
    gaps, nearest = [], []
    for begin in range(0, len(q), BLOCK):
        placed = link_poses(robot, q[begin:begin + BLOCK])[:, link] @ origin
        gap = np.empty((len(placed), len(pairs)))
        first, second = pairs[both].T
        gap[:, both] = segment_distances(placed[:, first], half[first], placed[:, second], half[second]) - radius[first] - radius[second]
        for k in np.flatnonzero(~both):
            gap[:, k] = coal_distances(*(bodies[b] for b in pairs[k]), placed[:, pairs[k, 0]], placed[:, pairs[k, 1]])
        nearest.append(gap.argmin(axis=1))
        gaps.append(gap.min(axis=1))
    return (np.concatenate(gaps), np.concatenate(nearest)) if gaps else (np.empty(0), np.empty(0, dtype=int))


def segment_distances(first, a, second, b):
    """Between segments along z of poses (M, K, 4, 4), half as long as a, b (K,): the least of where their lines are nearest,
    if that is on both, and of each end and the other segment."""
    u, v, centers = first[..., :3, 2], second[..., :3, 2], second[..., :3, 3] - first[..., :3, 3]
    cosine, along_u, along_v = (u * v).sum(-1), (u * centers).sum(-1), (v * centers).sum(-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = (along_u - cosine * along_v) / (1.0 - cosine**2)
        t = (cosine * along_u - along_v) / (1.0 - cosine**2)
    crossing = (np.abs(s) <= a) & (np.abs(t) <= b)
    choices = [(np.where(crossing, s, 0.0), np.where(crossing, t, 0.0))]
    choices += [(end, np.clip(cosine * end - along_v, -b, b)) for end in (-a, a)]
    choices += [(np.clip(cosine * end + along_u, -a, a), end) for end in (-b, b)]
    between = [np.linalg.norm(centers + np.expand_dims(t, -1) * v - np.expand_dims(s, -1) * u, axis=-1) for s, t in choices]
    return np.minimum.reduce(between)


def coal_distances(first, second, at, there):
    """(M,) between two bodies of a robot's description at poses (M, 4, 4)."""
    import coal

    solids = []
    for body in (first, second):
        if body["shape"] == "box":
            solids.append((coal.Box(*(np.array(body["size"]) - 2.0 * body["rounding"])), body["rounding"]))
        else:
            kinds = {"sphere": lambda b: coal.Sphere(b["radius"]), "capsule": lambda b: coal.Capsule(b["radius"], b["length"]),
                     "cylinder": lambda b: coal.Cylinder(b["radius"], b["length"])}
            solids.append((kinds[body["shape"]](body), 0.0))
    found, request, result = np.empty(len(at)), coal.DistanceRequest(), coal.DistanceResult()
    for m in range(len(at)):
        result.clear()
        poses = [coal.Transform3s(pose[:3, :3], pose[:3, 3]) for pose in (at[m], there[m])]
        found[m] = coal.distance(solids[0][0], poses[0], solids[1][0], poses[1], request, result) - solids[0][1] - solids[1][1]
    return found


class Ur5eMeshes:
    """Convex pieces of the UR5e's links, and the gripper and glass of robots/ur5e.yaml as the solids that its head names."""

    def __init__(self):
        import coal
        import pinocchio as pin

        self.coal = coal
        folder = Path(find_spec("airo_models").origin).parent / "arms/ur5e"
        model = pin.buildModelFromUrdf(str(folder / "ur5e.urdf"))
        visuals = pin.buildGeomFromUrdf(model, str(folder / "ur5e.urdf"), pin.GeometryType.VISUAL, package_dirs=[str(folder)])
        self.solids = []  # link, shape, placement in the link
        for shape in visuals.geometryObjects:
            frame = model.frames[shape.parentFrame]
            placement = (frame.placement.inverse() * shape.placement).homogeneous
            stem = Path(shape.meshPath).stem
            for name in FINER.get(stem, [stem]):  # in the frame of the visual mesh
                mesh = coal.MeshLoader().load(str(folder / f"collision/{name}.obj"), np.ones(3))
                mesh.buildConvexHull(False, "Qt")
                self.solids.append((LINKS.index(frame.name), mesh.convex, placement))
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
