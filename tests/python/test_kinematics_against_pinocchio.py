"""Position, rotation, Jacobian, acceleration of the glass and sphere centres against Pinocchio at random states."""

import os
import subprocess
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import yaml

ROOT = Path(os.environ.get("STEADYHAND_ROOT", Path(__file__).resolve().parents[2]))
PROGRAM = Path(os.environ.get("STEADYHAND_PROGRAM", ROOT / "build/release/steadyhand"))
BUILD = Path(os.environ.get("STEADYHAND_BUILD", PROGRAM.parent))
GRAVITY = np.array([0.0, 0.0, 9.81])
STATES = 10_000


class Oracle:
    """The robot file and its URDF, read without our program."""

    def __init__(self):
        robot = yaml.safe_load((ROOT / "robots/ur5e.yaml").read_text())
        [package] = ROOT.glob(f".deps/venv/lib/python3*/site-packages/{robot['urdf']['package']}")
        self.model = pin.buildModelFromUrdf(str(package / robot["urdf"]["path"]))
        tool = robot["tool"]
        turn = pin.rpy.rpyToMatrix(*tool["rpy"])
        self.tool = self.add_frame("the tool", tool["link"], pin.SE3(turn, np.array(tool["xyz"])))
        self.spheres = [
            self.add_frame(f"sphere {s['name']}", s["link"], pin.SE3(np.eye(3), np.array(s["center"])))
            for s in robot["spheres"]
        ]
        self.data = self.model.createData()

    def add_frame(self, name, link, placement):
        parent = self.model.getFrameId(link)
        assert parent < self.model.nframes, f"no link {link}"
        frame = self.model.frames[parent]
        return self.model.addFrame(
            pin.Frame(name, frame.parentJoint, parent, frame.placement * placement, pin.FrameType.OP_FRAME)
        )

    def evaluate(self, q, dq, ddq):
        pin.forwardKinematics(self.model, self.data, q, dq, ddq)
        pin.updateFramePlacements(self.model, self.data)
        aligned = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        pose = self.data.oMf[self.tool]
        jacobian = pin.computeFrameJacobian(self.model, self.data, q, self.tool, aligned)
        acceleration = pin.getFrameClassicalAcceleration(self.model, self.data, self.tool, aligned).linear
        return {
            "p": pose.translation.copy(),
            "R": pose.rotation.ravel(),
            "dp": jacobian[:3].T.ravel(),
            "axis": jacobian[3:].T.ravel(),
            "a_local": pose.rotation.T @ (acceleration + GRAVITY),
            "spheres": np.concatenate([self.data.oMf[i].translation for i in self.spheres]),
        }


@pytest.fixture(scope="module")
def both():
    oracle = Oracle()
    n = oracle.model.nq
    assert n == 6
    random = np.random.default_rng(7)
    states = np.hstack([random.uniform(-bound, bound, (STATES, n)) for bound in (2 * np.pi, np.pi, 15.0)])
    dump = BUILD / "kinematics_dump"
    assert dump.exists(), f"{dump} is missing: build the target `tests`"
    output = subprocess.run([dump, "ur5e"], input=states.tobytes(), check=True, capture_output=True).stdout
    expected = [oracle.evaluate(*np.split(state, 3)) for state in states]
    expected = {name: np.array([row[name] for row in expected]) for name in expected[0]}
    ours = np.frombuffer(output).reshape(STATES, -1)
    assert ours.shape[1] == sum(block.shape[1] for block in expected.values())
    blocks = np.split(ours, np.cumsum([block.shape[1] for block in expected.values()])[:-1], axis=1)
    return dict(zip(expected, blocks)), expected


@pytest.mark.parametrize(
    "name, tolerance",
    [("p", 1e-12), ("R", 1e-12), ("dp", 1e-12), ("axis", 1e-12), ("spheres", 1e-12), ("a_local", 1e-9)],
)
def test_agrees_with_pinocchio(both, name, tolerance):
    ours, expected = both
    difference = np.abs(ours[name] - expected[name]).max()
    print(f"{name}: largest difference {difference:.1e} at {STATES} states")
    assert difference < tolerance
