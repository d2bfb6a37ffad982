#!/usr/bin/env python3
"""Fits 29 spheres to the UR5e and prints the `spheres` of robots/ur5e.yaml.

What is asked: every point of every visual mesh, and of the convex parts that stand for the solid arm, lies inside a
sphere of its own link; and the spheres give away as little of the collision-free joint space as 29 can.

How:
1. Where bulges cost. Random joint angles, uniform in +-pi; for each pair of non-neighbouring links that come within
   NEAR of each other without touching, the nearest points p_a, p_b of the true convex parts (coal). The other link is
   thought of as a ball of radius BALL that touches at p_b; the spheres of link a take away room there in proportion to
   bulge = |p - p_a| - min_i(|c_i - p| - r_i), p = p_b + BALL (p_b - p_a) / |p_b - p_a|.
   Links that often come near others have many such probes: the sum over all links estimates the room given away.
2. Per link and number of spheres: minimise the mean bulge subject to cover, by Adam on a penalty that rises, from several
   starts; then the radii are repaired to cover exactly and shrunk to what they alone must hold.
3. The split of 29 over the links is the one of least summed cost (dynamic programming).
4. All spheres together: minimise the smoothed share of truly free configurations that the real sphere pairs refuse.

    .deps/venv/bin/python robots/fit_spheres.py [--seed 1] [--starts 4] [--refine 400] > spheres.yaml
"""

from __future__ import annotations

import argparse
import sys

import coal
import numpy as np
from scipy.spatial.distance import cdist

from arm_geometry import LINKS, Arm, Mesh, package_folder

SPHERES = 29
MARGIN = 1e-4  # m, how deep inside a sphere every point lies at least
MOST_PER_LINK = 9
NEAR = 0.06  # m
BALL = 0.04  # m, about the radius of the arm's tubes
SHORT = ["base", "shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3"]


def log(*words: object) -> None:
    print(*words, file=sys.stderr, flush=True)


def convex_shape(mesh: Mesh) -> coal.Convex:
    points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for vertex in mesh.vertices:
        points.append(vertex)
    for a, b, c in mesh.triangles:
        triangles.append(coal.Triangle(int(a), int(b), int(c)))
    return coal.Convex(points, triangles)


def random_contacts(arm: Arm, count: int, rng: np.random.Generator):
    """Random configurations and what the true convex parts do there.

    Returns the link poses (M, 7, 4, 4) of the truly free ones and, per link, the probes of step 1: rows of p in its frame and
    |p - p_a|, (K, 4).
    """
    shapes = [[convex_shape(part) for part in parts] for parts in arm.convex]
    poses = arm.link_poses(rng.uniform(-np.pi, np.pi, (count, 6)))
    free, probes = [], [[] for _ in LINKS]
    request = coal.DistanceRequest()
    for pose in poses:
        transforms = [coal.Transform3s(T[:3, :3], T[:3, 3]) for T in pose]
        near = []
        for a in range(len(LINKS)):
            for b in range(a + 2, len(LINKS)):
                best = None
                for shape_a in shapes[a]:
                    for shape_b in shapes[b]:
                        result = coal.DistanceResult()
                        coal.distance(shape_a, transforms[a], shape_b, transforms[b], request, result)
                        if best is None or result.min_distance < best.min_distance:
                            best = result
                if best.min_distance < NEAR:
                    near.append((a, b, best))
        if any(result.min_distance <= 0 for _, _, result in near):
            continue
        free.append(pose)
        for a, b, result in near:
            p_a, p_b = result.getNearestPoint1(), result.getNearestPoint2()
            for link, own, other in ((a, p_a, p_b), (b, p_b, p_a)):
                probe = other + BALL * (other - own) / np.linalg.norm(other - own)
                probes[link].append([*pose[link, :3, :3].T @ (probe - pose[link, :3, 3]), result.min_distance + BALL])
    return np.array(free), [np.array(points) for points in probes]


def surface_points(meshes: list[Mesh], spacing: float) -> np.ndarray:
    """Vertices and points on the triangles no further apart than spacing (m), each mesh point once."""
    points = []
    for mesh in meshes:
        corners = mesh.vertices[mesh.triangles]
        points.append(mesh.vertices)
        edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        steps = np.ceil(edges / spacing).astype(int)
        for n in np.unique(steps[steps > 1]):
            i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1))
            weights = np.stack([i, j, n - i - j])[:, i + j <= n].T / n
            points.append((weights @ corners[steps == n]).reshape(-1, 3))
    return np.unique(np.vstack(points).round(6), axis=0)


def thinned(points: np.ndarray, cell: float) -> np.ndarray:
    """One point per cubic cell."""
    _, first = np.unique(np.floor(points / cell).astype(int), axis=0, return_index=True)
    return points[first]


def depth_gradient(points: np.ndarray, centers: np.ndarray, radii: np.ndarray):
    """Signed distance to the union of balls, the nearest ball's index, and the direction from its centre."""
    offsets = points[:, None, :] - centers
    lengths = np.sqrt((offsets**2).sum(axis=2)) + 1e-12
    signed = lengths - radii
    nearest = signed.argmin(axis=1)
    row = np.arange(len(points))
    return signed[row, nearest], nearest, offsets[row, nearest] / lengths[row, nearest, None]


class CoverLoss:
    """Mean bulge at the probes plus weight * mean squared gap of the surface points; gradient by (centre, radius)."""

    def __init__(self, surface: np.ndarray, probes: np.ndarray):
        self.surface, self.probes, self.room = surface, probes[:, :3], probes[:, 3].mean()

    def __call__(self, centers: np.ndarray, radii: np.ndarray, weight: float):
        grad_c, grad_r = np.zeros_like(centers), np.zeros_like(radii)
        signed, nearest, direction = depth_gradient(self.probes, centers, radii)
        np.add.at(grad_c, nearest, direction / len(self.probes))
        np.add.at(grad_r, nearest, 1.0 / len(self.probes))
        loss = self.room - signed.mean()
        signed, nearest, direction = depth_gradient(self.surface, centers, radii)
        gap = np.maximum(signed + MARGIN, 0.0)
        scale = 2 * weight * gap / len(self.surface)
        np.add.at(grad_c, nearest, -direction * scale[:, None])
        np.add.at(grad_r, nearest, -scale)
        return loss + weight * (gap**2).mean(), grad_c, grad_r


def descend(loss, centers: np.ndarray, radii: np.ndarray, weights: np.ndarray, rates: np.ndarray):
    """Adam, one step per entry of weights (penalty) and rates (m)."""
    x = np.column_stack([centers, radii])
    first, second = np.zeros_like(x), np.zeros_like(x)
    for step, (weight, rate) in enumerate(zip(weights, rates), start=1):
        _, grad_c, grad_r = loss(x[:, :3], x[:, 3], weight)
        grad = np.column_stack([grad_c, grad_r])
        first = 0.9 * first + 0.1 * grad
        second = 0.99 * second + 0.01 * grad**2
        x = x - rate * (first / (1 - 0.9**step)) / (np.sqrt(second / (1 - 0.99**step)) + 1e-9)
    return x[:, :3], x[:, 3]


def repaired(points: np.ndarray, centers: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Radii that cover all points: grow for the uncovered ones, then shrink each to what no other sphere holds."""
    lengths = cdist(points, centers) + MARGIN
    radii = radii.copy()
    while True:
        signed = lengths - radii
        outside = np.flatnonzero(signed.min(axis=1) > 1e-12)
        if len(outside) == 0:
            break
        worst = outside[signed[outside].min(axis=1).argmax()]
        sphere = signed[worst].argmin()
        radii[sphere] = lengths[worst, sphere]
    for sphere in np.argsort(-radii):
        others = np.delete(lengths - radii, sphere, axis=1).min(axis=1, initial=np.inf)
        alone = lengths[others > 0, sphere]
        radii[sphere] = alone.max() if len(alone) else 0.0
    return radii


def start_by_clusters(points: np.ndarray, count: int, rng: np.random.Generator):
    """k-means++ seeds and Lloyd steps; the ball of each cluster about its middle."""
    centers = points[rng.integers(len(points))][None]
    while len(centers) < count:
        distance = cdist(points, centers).min(axis=1) ** 2
        centers = np.vstack([centers, points[rng.choice(len(points), p=distance / distance.sum())]])
    for _ in range(15):
        label = cdist(points, centers).argmin(axis=1)
        centers = np.array([points[label == i].mean(axis=0) if (label == i).any() else c for i, c in enumerate(centers)])
    label = cdist(points, centers).argmin(axis=1)
    radii = np.array([np.linalg.norm(points[label == i] - c, axis=1).max(initial=0.01) for i, c in enumerate(centers)])
    return centers, radii


def fit_link(dense, coarse, probes, count, starts, rng):
    """Best of several starts: (mean bulge, centers, radii)."""
    loss = CoverLoss(coarse, probes)
    best = None
    steps = 500
    for _ in range(starts):
        centers, radii = start_by_clusters(coarse, count, rng)
        centers, radii = descend(loss, centers, radii, np.geomspace(3e2, 3e6, steps), np.geomspace(2e-3, 5e-5, steps))
        radii = repaired(dense, centers, radii)
        bulge = loss(centers, radii, 0.0)[0]
        if best is None or bulge < best[0]:
            best = (bulge, centers, radii)
    return best


def split(costs: list[dict[int, float]], total: int) -> list[int]:
    """Numbers per link that sum to total at the least summed cost."""
    table = {0: (0.0, [])}
    for cost in costs:
        grown: dict[int, tuple[float, list[int]]] = {}
        for used, (value, numbers) in table.items():
            for count, extra in cost.items():
                candidate = (value + extra, numbers + [count])
                if used + count <= total and (used + count not in grown or candidate < grown[used + count]):
                    grown[used + count] = candidate
        table = grown
    return table[total][1]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--starts", type=int, default=4, help="starts per link and number of spheres")
    parser.add_argument("--configurations", type=int, default=4000)
    parser.add_argument("--save", help="npz of the fits")
    arguments = parser.parse_args()
    rng = np.random.default_rng(arguments.seed)

    arm = Arm(package_folder("airo_models") / "arms/ur5e/ur5e.urdf")
    free, probes = random_contacts(arm, arguments.configurations, rng)
    log(f"{len(free)} of {arguments.configurations} configurations are truly free")
    fits, costs = [], []
    for link in range(len(LINKS)):
        dense = thinned(surface_points(arm.visual[link] + arm.convex[link], 0.003), 0.0015)
        coarse = thinned(dense, 0.006)
        weight = len(probes[link]) / arguments.configurations
        some = probes[link][rng.permutation(len(probes[link]))[:3000]]
        fits.append({})
        for count in range(1, MOST_PER_LINK + 1):
            if link == 0 and count < 2:
                continue
            fits[-1][count] = fit_link(dense, coarse, some, count, arguments.starts, rng)
        costs.append({count: weight * fit[0] for count, fit in fits[-1].items()})
        log(SHORT[link], len(dense), len(coarse), "mm:", {count: round(float(1e3 * c), 2) for count, c in costs[-1].items()})
    numbers = split(costs, SPHERES)
    log("numbers per link", numbers)
    print("spheres:")
    for link, count in enumerate(numbers):
        _, centers, radii = fits[link][count]
        for i, (center, radius) in enumerate(zip(centers, radii)):
            x, y, z = center
            r = np.ceil((radius + 2e-5) * 1e5) / 1e5
            print(f"  - {{name: {SHORT[link]}_{i}, link: {LINKS[link]}, center: [{x:.5f}, {y:.5f}, {z:.5f}], radius: {r:.5f}}}")
    if arguments.save:
        np.save(arguments.save, np.array([numbers, fits, costs], dtype=object), allow_pickle=True)


if __name__ == "__main__":
    main()
