"""make_arm_mesh.py ARM.urdf OUT.glb: the visual OBJ meshes of a URDF's chain as one small glTF file.

One node for each link frame of `steadyhand describe`, "link0" (the base) to "linkN": what hangs on fixed joints is folded
in, as there. Vertices are merged on a grid and stored as 16-bit numbers (KHR_mesh_quantization), which makes a tenth of the text's
size; the web server sends the file gzipped on top.
"""

import json
import re
import struct
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np

GRID = 0.0012  # m; details below this cannot be seen from where the camera stands
COLORS = {  # of the materials' names, as linear base colour, roughness, metalness
    "Black": ((0.025, 0.027, 0.03), 0.6, 0.1),
    "JointGrey": ((0.19, 0.2, 0.22), 0.45, 0.5),
    "LinkGrey": ((0.62, 0.64, 0.67), 0.35, 0.5),
    "URBlue": ((0.17, 0.42, 0.7), 0.5, 0.1),
}


def transform(origin):
    """4 x 4 of a URDF <origin>; None is the identity."""
    matrix = np.eye(4)
    if origin is None:
        return matrix
    roll, pitch, yaw = (float(x) for x in origin.get("rpy", "0 0 0").split())
    rx = np.array([[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]])
    ry = np.array([[np.cos(pitch), 0, np.sin(pitch)], [0, 1, 0], [-np.sin(pitch), 0, np.cos(pitch)]])
    rz = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    matrix[:3, :3] = rz @ ry @ rx
    matrix[:3, 3] = [float(x) for x in origin.get("xyz", "0 0 0").split()]
    return matrix


def visuals(urdf):
    """(index of the link frame, pose in it, mesh file) of every visual of the chain."""
    text = re.sub(r"([</ ])drake:", r"\1", urdf.read_text())  # a prefix that nobody declares
    robot = ElementTree.fromstring(text)
    links = {link.get("name"): link for link in robot.findall("link")}
    joints = robot.findall("joint")
    children = {joint.find("child").get("link") for joint in joints}
    (root,) = (name for name in links if name not in children)
    found, ahead = [], [(root, 0, np.eye(4))]
    while ahead:
        name, frame, pose = ahead.pop()
        for visual in links[name].findall("visual"):
            mesh = visual.find("geometry/mesh")
            if mesh is not None:
                found.append((frame, pose @ transform(visual.find("origin")), urdf.parent / mesh.get("filename")))
        for joint in joints:
            if joint.find("parent").get("link") != name:
                continue
            child = joint.find("child").get("link")
            if joint.get("type") == "fixed":
                ahead.append((child, frame, pose @ transform(joint.find("origin"))))
            else:
                ahead.append((child, frame + 1, np.eye(4)))
    return found


def read_obj(path):
    """{material: (corner positions [n, 3, 3], corner normals)}; polygons are cut into fans."""
    positions, normals, faces, material = [], [], {}, ""
    for line in path.read_text().splitlines():
        word, _, rest = line.partition(" ")
        if word == "v":
            positions.append([float(x) for x in rest.split()[:3]])
        elif word == "vn":
            normals.append([float(x) for x in rest.split()])
        elif word == "usemtl":
            material = rest.split(".")[0].strip()
        elif word == "f":
            corners = [[int(x) if x else 0 for x in corner.split("/")] for corner in rest.split()]
            for i in range(1, len(corners) - 1):
                faces.setdefault(material, []).append([(c[0], c[2]) for c in (corners[0], corners[i], corners[i + 1])])
    positions, normals = np.array(positions), np.array(normals)
    return {name: (positions[(f := np.array(list_))[:, :, 0] - 1], normals[f[:, :, 1] - 1]) for name, list_ in faces.items()}


def merge(positions, normals):
    """Vertices on a grid, one for each direction in which a surface looks there: positions, normals, triangles."""
    cell = np.round(positions.reshape(-1, 3) / GRID).astype(np.int64)
    side = np.round(normals.reshape(-1, 3) * 1.4).astype(np.int64)
    keys, index = np.unique(np.hstack([cell, side]), axis=0, return_inverse=True)
    mean = np.zeros((len(keys), 3))
    np.add.at(mean, index.ravel(), normals.reshape(-1, 3))
    mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-9)
    triangles = index.reshape(-1, 3)
    place = cell.reshape(-1, 3, 3)
    flat = (place[:, 0] == place[:, 1]).all(1) | (place[:, 1] == place[:, 2]).all(1) | (place[:, 2] == place[:, 0]).all(1)
    triangles = triangles[~flat]
    turned = np.take_along_axis(triangles, (triangles.argmin(1)[:, None] + np.arange(3)) % 3, 1)
    triangles = np.unique(turned, axis=0)
    used, index = np.unique(triangles, return_inverse=True)
    return keys[used, :3] * GRID, mean[used], index.reshape(-1, 3)


class Gltf:
    def __init__(self):
        self.blob = bytearray()
        self.json = {"asset": {"version": "2.0", "generator": "steadyhand"}, "scene": 0, "scenes": [{"nodes": []}],
                     "extensionsUsed": ["KHR_mesh_quantization"], "extensionsRequired": ["KHR_mesh_quantization"],
                     "nodes": [], "meshes": [], "materials": [], "accessors": [], "bufferViews": []}

    def add(self, array, kind, component, target, stride=None, **more):
        while len(self.blob) % 4:
            self.blob.append(0)
        view = {"buffer": 0, "byteOffset": len(self.blob), "byteLength": array.nbytes, "target": target}
        if stride:
            view["byteStride"] = stride
        self.json["bufferViews"].append(view)
        self.blob += array.tobytes()
        self.json["accessors"].append({"bufferView": len(self.json["bufferViews"]) - 1, "componentType": component,
                                       "count": len(array) if kind == "VEC3" else array.size, "type": kind, **more})
        return len(self.json["accessors"]) - 1

    def material(self, name):
        color, roughness, metalness = COLORS.get(name, ((0.1, 0.1, 0.11), 0.7, 0.0))
        for i, known in enumerate(self.json["materials"]):
            if known["name"] == name:
                return i
        self.json["materials"].append({"name": name, "pbrMetallicRoughness": {
            "baseColorFactor": [*color, 1], "roughnessFactor": roughness, "metallicFactor": metalness}})
        return len(self.json["materials"]) - 1

    def mesh(self, positions, normals, triangles, material):
        """Index of a node; its scale and place undo the quantisation."""
        low, high = positions.min(0), positions.max(0)
        middle, scale = (low + high) / 2, float(max(high - low)) / 2
        q = np.zeros((len(positions), 4), np.int16)
        q[:, :3] = np.round((positions - middle) / scale * 32767)
        n = np.zeros((len(normals), 4), np.int8)
        n[:, :3] = np.round(normals * 127)
        bounds = {"min": q[:, :3].min(0).tolist(), "max": q[:, :3].max(0).tolist()}
        wide = len(positions) > 65535
        mesh = {"primitives": [{
            "attributes": {"POSITION": self.add(q, "VEC3", 5122, 34962, 8, normalized=True, **bounds),
                           "NORMAL": self.add(n, "VEC3", 5120, 34962, 4, normalized=True)},
            "indices": self.add(triangles.astype(np.uint32 if wide else np.uint16), "SCALAR", 5125 if wide else 5123, 34963),
            "material": self.material(material)}]}
        self.json["meshes"].append(mesh)
        self.json["nodes"].append({"mesh": len(self.json["meshes"]) - 1, "translation": middle.tolist(), "scale": [scale] * 3})
        return len(self.json["nodes"]) - 1

    def write(self, path):
        self.json["buffers"] = [{"byteLength": len(self.blob)}]
        text = json.dumps(self.json, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        self.blob += b"\0" * (-len(self.blob) % 4)
        total = 12 + 8 + len(text) + 8 + len(self.blob)
        path.write_bytes(struct.pack("<4sII", b"glTF", 2, total) + struct.pack("<I4s", len(text), b"JSON") + text +
                         struct.pack("<I4s", len(self.blob), b"BIN\0") + self.blob)


def main(urdf, out):
    gltf, frames = Gltf(), {}
    for frame, pose, path in visuals(urdf):
        for material, (positions, normals) in read_obj(path).items():
            placed = positions @ pose[:3, :3].T + pose[:3, 3]
            merged = merge(placed, normals @ pose[:3, :3].T)
            if len(merged[2]):
                frames.setdefault(frame, []).append(gltf.mesh(*merged, material))
    for frame, nodes in sorted(frames.items()):
        gltf.json["nodes"].append({"name": f"link{frame}", "children": nodes})
        gltf.json["scenes"][0]["nodes"].append(len(gltf.json["nodes"]) - 1)
    out.parent.mkdir(parents=True, exist_ok=True)
    gltf.write(out)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
