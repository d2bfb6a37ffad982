"""Distances inside the arm, by kinematics of our own of the bodies in the recording's metadata. What these cover is tested elsewhere
(tests/python/test_spheres.py)."""

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


def smallest_body_gaps(robot, q):
    """Of the nearest pair of spheres at each configuration: gap in m (M,), and which pair (M,)."""
    bodies, pairs = robot["bodies"], np.array(robot["pairs"])
    assert all(body["shape"] == "sphere" for body in bodies), "the adversary's robot is the UR5e with its balls"
    link = np.array([b["link"] for b in bodies])
    center = np.array([b["origin"] for b in bodies], dtype=float)[:, :, 3:]
    radius = np.array([b["radius"] for b in bodies], dtype=float)
    first, second = pairs.T
    gaps, nearest = [], []
    for begin in range(0, len(q), BLOCK):
        at = (link_poses(robot, q[begin:begin + BLOCK])[:, link] @ center)[:, :, :3, 0]
        gap = np.linalg.norm(at[:, first] - at[:, second], axis=-1) - radius[first] - radius[second]
        nearest.append(gap.argmin(axis=1))
        gaps.append(gap.min(axis=1))
    return (np.concatenate(gaps), np.concatenate(nearest)) if gaps else (np.empty(0), np.empty(0, dtype=int))
