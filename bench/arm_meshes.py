"""An arm's own meshes, by other programs than ours: Pinocchio's kinematics of the URDF and Coal's distances of its collision
geometry. For the Universal Robots, whose URDFs have hulls and balls for that, the meshes that their package has beside them."""

from __future__ import annotations

import itertools
import os
import re
import subprocess
import sys
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin
import steadyhand
import yaml
from scipy.spatial import ConvexHull

ROOT = Path(__file__).resolve().parents[1]
os.environ["PATH"] = f"{Path(sys.executable).parent}:{os.environ['PATH']}"  # where xacro is
FINER = {"upperarm": [f"upper_arm_link_part_{i}" for i in range(3)], "forearm": [f"forearm_link_part_{i}" for i in range(3)],
         "base_cable_labels": ["base"]}  # fmt: skip  # by stem of the visual mesh; else its own


def settings_of(robot: str) -> dict:
    """What a robot file says, with what the files say that it extends."""
    path = Path(robot) if robot.endswith(".yaml") else ROOT / f"robots/{robot}.yaml"
    settings = yaml.safe_load(path.read_text())
    return (settings_of(settings["extends"]) if "extends" in settings else {}) | settings


def urdf_of(robot: str) -> Path:
    urdf = settings_of(robot)["urdf"]
    for folder in map(Path, sys.path):
        path = folder / urdf["package"] / urdf["path"]
        if path.exists():
            return path
    raise SystemExit(f"the package {urdf['package']} of robot {robot} is not installed")


def text_of(urdf: Path, expand: bool) -> str:
    text = urdf.read_text().replace("drake:", "drake_")
    if expand:
        text = subprocess.run(["xacro", str(urdf)], capture_output=True, text=True, check=True).stdout

    def found(name: re.Match) -> str:  # packages are copied under other names
        path = name[1].split("/", 1)[1]
        return str(next((above / path for above in urdf.parents if (above / path).exists()), name[0]))

    return re.sub(r"package://([^\"]+)", found, text)


def hull_of(shape):
    """The convex hull of a mesh, which is never further away than the mesh; of what is convex, itself."""
    if not isinstance(shape, coal.BVHModelBase):
        return shape
    vertices = np.array([shape.vertex(i) for i in range(shape.num_vertices)])
    hull = ConvexHull(vertices)
    kept = {old: new for new, old in enumerate(hull.vertices)}
    points, faces = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for vertex in vertices[hull.vertices]:
        points.append(vertex)
    for face, normal in zip(hull.simplices, hull.equations[:, :3]):
        a, b, c = face if np.dot(np.cross(*(vertices[face[1:]] - vertices[face[0]])), normal) > 0 else face[::-1]
        faces.append(coal.Triangle(kept[a], kept[b], kept[c]))
    return coal.Convex(points, faces)


class ArmMeshes:
    """Parts of a robot that is shipped, or of a robot file, and where they are."""

    def __init__(self, name: str):
        self.robot = steadyhand.Robot(name)
        urdf = urdf_of(name)
        text = text_of(urdf, settings_of(name)["urdf"].get("xacro", False))
        folders = [str(urdf.parent), *map(str, urdf.parents)]
        self.model = pin.buildModelFromXML(text)
        self.data = self.model.createData()
        self.joints = [self.model.getJointId(joint) for joint in self.robot.joint_names]
        self.rest = pin.neutral(self.model)
        for joint, value in settings_of(name).get("locked", {}).items():
            self.rest[self.model.joints[self.model.getJointId(joint)].idx_q] = value
        self.parts = []  # (link behind so many joints, joint of Pinocchio's, placement in it, (its hull, itself))
        for joint, placement, geometry in self._geometry(urdf, text, folders):
            path = set(self.model.supports[joint])
            self.parts.append((sum(own in path for own in self.joints), joint, placement, (hull_of(geometry), geometry)))
        links = {part[0] for part in self.parts}
        bodies = self.robot.description["bodies"]
        known = {tuple(sorted((bodies[a]["link"], bodies[b]["link"]))) for a, b in self.robot.description["pairs"]}
        apart = {(a, b) for a, b in itertools.combinations(sorted(links), 2) if b > a + 1}
        indices = list(itertools.combinations(range(len(self.parts)), 2))
        between = lambda pairs: [(a, b) for a, b in indices if tuple(sorted((self.parts[a][0], self.parts[b][0]))) in pairs]
        self.pairs = between(known)  # those that the robot keeps apart
        self.all_pairs = between(apart)  # all that are not neighbours

    def _geometry(self, urdf: Path, text: str, folders: list[str]):
        """Joint of Pinocchio's, placement in it, and shape."""
        if (urdf.parent / "collision").is_dir() and (urdf.parent / "visual").is_dir():  # airo-models
            loader = coal.MeshLoader()
            visuals = pin.buildGeomFromUrdfString(self.model, text, pin.GeometryType.VISUAL, package_dirs=folders)
            for part in visuals.geometryObjects:
                stem = Path(part.meshPath).stem
                files = [urdf.parent / f"collision/{name}.obj" for name in FINER.get(stem, [stem])]
                if not all(file.exists() for file in files):
                    files = [urdf.parent / f"collision/{stem}.obj"]
                for file in files:
                    yield part.parentJoint, part.placement, loader.load(str(file), np.ones(3))
            return
        geometry = pin.buildGeomFromUrdfString(self.model, text, pin.GeometryType.COLLISION, package_dirs=folders)
        for part in geometry.geometryObjects:
            yield part.parentJoint, part.placement, part.geometry

    def move(self, q) -> None:
        """Has Pinocchio know where the joints are. Those without limits have a cosine and a sine there."""
        for joint, angle in zip(self.joints, q):
            model = self.model.joints[joint]
            self.rest[model.idx_q : model.idx_q + model.nq] = angle if model.nq == 1 else (np.cos(angle), np.sin(angle))
        pin.forwardKinematics(self.model, self.data, self.rest)

    def place(self, q) -> list:
        """Where each part is."""
        self.move(q)
        at = []
        for _, joint, placement, _ in self.parts:
            M = self.data.oMi[joint] * placement
            at.append(coal.Transform3s(M.rotation, M.translation))
        return at

    def touches(self, q) -> bool:
        """Whether any two parts that are not neighbours do."""
        at, request = self.place(q), coal.CollisionRequest()
        hit = lambda a, b, which: coal.collide(self.parts[a][3][which], at[a], self.parts[b][3][which], at[b], request, coal.CollisionResult())
        return any(hit(a, b, 0) and hit(a, b, 1) for a, b in self.all_pairs)
