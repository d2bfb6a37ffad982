"""Conversion between 4x4 poses and quaternions in the order x, y, z, w."""

import numpy as np
from numpy.typing import ArrayLike

from ._arrays import Array, array


def pose(p: ArrayLike = (0.0, 0.0, 0.0), quat_xyzw: ArrayLike = (0.0, 0.0, 0.0, 1.0)) -> Array:
    """Makes a (4, 4) matrix from a position (3,), m, and a quaternion (4,) in the order x, y, z, w.

    (m, 3) and (m, 4) give (m, 4, 4). Raises ValueError for other shapes, and if a norm differs from 1 by more than 0.001.
    """
    p = array("p", p, (3,), ("m", 3))
    quat = array("quat_xyzw", quat_xyzw, (4,), ("m", 4), what="in the order x, y, z, w")
    norm = np.linalg.norm(quat, axis=-1, keepdims=True)
    if np.abs(norm - 1.0).max(initial=0.0) > 1e-3:
        raise ValueError(f"quat_xyzw is of length {norm.ravel()[np.abs(norm - 1.0).argmax()]:.6g}; it must be 1")
    x, y, z, w = np.moveaxis(quat / norm, -1, 0)
    R = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    R = np.moveaxis(R, (0, 1), (-2, -1))
    T = np.zeros(np.broadcast_shapes(R.shape[:-2], p.shape[:-1]) + (4, 4))
    T[..., :3, :3] = R
    T[..., :3, 3] = p
    T[..., 3, 3] = 1.0
    return T


def quat_xyzw(T: ArrayLike) -> Array:
    """Returns the quaternion (4,) of a (4, 4) matrix, in the order x, y, z, w, with w >= 0. (m, 4, 4) gives (m, 4).

    Raises ValueError for other shapes.
    """
    T = array("T", T, (4, 4), ("m", 4, 4))
    if T.ndim == 3:
        return np.array([quat_xyzw(each) for each in T]).reshape(-1, 4)
    # It is the eigenvector of K to the largest eigenvalue (Bar-Itzhack 2000): well-conditioned everywhere.
    R = T[:3, :3]
    K = np.empty((4, 4))
    K[:3, :3] = R + R.T - np.trace(R) * np.eye(3)
    K[:3, 3] = K[3, :3] = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    K[3, 3] = np.trace(R)
    quat = np.linalg.eigh(K)[1][:, 3]
    return -quat if quat[3] < 0 else quat
