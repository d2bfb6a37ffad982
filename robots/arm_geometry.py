"""Geometry of the UR5e as the URDF's package describes it: link poses, visual meshes, convex collision parts.

Shared by fit_spheres.py. Links are numbered as in the robot file: 0 is the base, k is the link behind joint k.
All lengths in m; every mesh is returned in the frame of its URDF link (base_link_inertia for link 0).
"""

from __future__ import annotations

import importlib.util
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path

import numpy as np

LINKS = [
    "base_link_inertia",
    "shoulder_link",
    "upper_arm_link",
    "forearm_link",
    "wrist_1_link",
    "wrist_2_link",
    "wrist_3_link",
]
JOINTS = [
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "elbow_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
]

# The URDF names one non-convex collision mesh for each long link and bare spheres for the base. The package also holds
# convex pieces of the same bodies, modelled in the frames of the visual meshes; together they are the solid arm.
CONVEX_PARTS = {
    "base_link_inertia": ["base"],
    "shoulder_link": ["shoulder"],
    "upper_arm_link": ["upper_arm_link_part_0", "upper_arm_link_part_1", "upper_arm_link_part_2"],
    "forearm_link": ["forearm_link_part_0", "forearm_link_part_1", "forearm_link_part_2"],
    "wrist_1_link": ["wrist1"],
    "wrist_2_link": ["wrist2"],
    "wrist_3_link": ["wrist3"],
}


@dataclass(frozen=True)
class Mesh:
    """Triangles of one file: vertices (V, 3) in the link's frame, triangles (T, 3) indices into them."""

    vertices: np.ndarray
    triangles: np.ndarray


def package_folder(name: str) -> Path:
    """Folder of an installed Python package, found without importing it."""
    spec = importlib.util.find_spec(name)
    if spec is None or not spec.submodule_search_locations:
        raise SystemExit(f"Python package {name} is not installed; run ./steadyhand once, it sets .deps/venv up")
    return Path(spec.submodule_search_locations[0])


def read_obj(path: Path) -> Mesh:
    """Wavefront OBJ: `v` and `f` lines (polygons as fans, one-based indices), everything else is appearance."""
    vertices, triangles = [], []
    for line in path.read_text().splitlines():
        if line.startswith("v "):
            vertices.append([float(word) for word in line.split()[1:4]])
        elif line.startswith("f "):
            corner = [int(word.split("/")[0]) - 1 for word in line.split()[1:]]
            triangles += [(corner[0], corner[i], corner[i + 1]) for i in range(1, len(corner) - 1)]
    return Mesh(np.array(vertices), np.array(triangles))


def rotation_from_rpy(rpy: np.ndarray) -> np.ndarray:
    """URDF's fixed-axis roll, pitch, yaw to a rotation matrix: Rz(yaw) Ry(pitch) Rx(roll)."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(rpy), np.cos(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def origin_of(element: ElementTree.Element) -> np.ndarray:
    """The 4x4 transform of an element's <origin>; identity where there is none."""
    transform = np.eye(4)
    origin = element.find("origin")
    if origin is not None:
        transform[:3, :3] = rotation_from_rpy(np.array(origin.get("rpy", "0 0 0").split(), dtype=float))
        transform[:3, 3] = np.array(origin.get("xyz", "0 0 0").split(), dtype=float)
    return transform


def placed(mesh: Mesh, transform: np.ndarray) -> Mesh:
    return Mesh(mesh.vertices @ transform[:3, :3].T + transform[:3, 3], mesh.triangles)


class Arm:
    """The URDF's chain with the meshes of its links."""

    def __init__(self, urdf: Path):
        # The file uses the prefix drake: without declaring it, which a strict XML parser refuses.
        root = ElementTree.fromstring(urdf.read_text().replace("drake:", "drake_"))
        links = {link.get("name"): link for link in root.iter("link")}
        joints = {joint.get("name"): joint for joint in root.findall("joint")}
        self.joint_origins = np.array([origin_of(joints[name]) for name in JOINTS])
        self.visual: list[list[Mesh]] = []
        self.convex: list[list[Mesh]] = []
        for name in LINKS:
            visuals = links[name].findall("visual")
            files = [(urdf.parent / v.find("geometry/mesh").get("filename"), origin_of(v)) for v in visuals]
            self.visual.append([placed(read_obj(file), origin) for file, origin in files])
            parts = [urdf.parent / "collision" / f"{part}.obj" for part in CONVEX_PARTS[name]]
            self.convex.append([placed(read_obj(part), origin_of(visuals[0])) for part in parts])

    def link_poses(self, q: np.ndarray) -> np.ndarray:
        """Poses of the links in link 0, (M, 7, 4, 4), for joint angles q (M, 6) in rad. Every axis is the link's z."""
        poses = np.empty((len(q), len(LINKS), 4, 4))
        poses[:, 0] = np.eye(4)
        for k, origin in enumerate(self.joint_origins):
            turn = np.tile(np.eye(4), (len(q), 1, 1))
            c, s = np.cos(q[:, k]), np.sin(q[:, k])
            turn[:, 0, 0], turn[:, 0, 1], turn[:, 1, 0], turn[:, 1, 1] = c, -s, s, c
            poses[:, k + 1] = poses[:, k] @ origin @ turn
        return poses
