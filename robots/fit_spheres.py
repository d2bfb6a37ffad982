#!/usr/bin/env python3
"""Fits 29 spheres to the UR5e and prints the arm's part of `spheres` in robots/ur5e.yaml.

What is asked: every point of every visual mesh, and of the convex parts that stand for the solid arm, lies inside a
sphere of its own link; and the spheres give away as little of the collision-free joint space as 29 can.

How:
1. Where bulges cost. Random joint angles, uniform in +-pi; for each pair of non-neighbouring links that come within
   NEAR of each other without touching, the nearest points p_a, p_b of the true convex parts (coal). The other link is
   thought of as a ball of radius BALL that touches at p_b; the spheres of link a take away room there in proportion to
   bulge = |p - p_a| - min_i(|c_i - p| - r_i), p = p_b + BALL (p_b - p_a) / |p_b - p_a|.
   Links that often come near others have many such probes: the sum over all links estimates the room given away.
2. Per link and number of spheres: minimise the mean bulge subject to cover, by Adam on a penalty that rises, from
   several starts; then the radii are repaired to cover exactly and shrunk to what they alone must hold.
3. The split of 29 over the links is the one of least summed cost (dynamic programming).
4. All spheres together: minimise the smoothed share of truly free configurations that the real sphere pairs refuse.
5. Again and again: take away a sphere that is little missed, cut one in two that is to blame for refusals, repeat 4,
   keep what is better.
6. Prove the cover: a triangle whose corners share a sphere lies in it, any other is cut into four; where that does not
   end, the corners join the points that must be covered.

Steps 1 to 3 take some minutes, a round of step 5 about 10 s. The shipped file is the best of about 70 rounds; another
seed ends near it, not at it.

    .deps/venv/bin/python robots/fit_spheres.py [--seed 1] [--rounds 40] > spheres.yaml
    .deps/venv/bin/python robots/fit_spheres.py --resume robots/ur5e.yaml --seed 2 --rounds 10 > spheres.yaml
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import coal
import numpy as np
import yaml
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

    Returns the link poses (M, 7, 4, 4) of the truly free ones and, per link, the probes of step 1: rows of p in its
    frame and |p - p_a|, (K, 4).
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
        for i in np.unique(label):
            centers[i] = points[label == i].mean(axis=0)
    label = cdist(points, centers).argmin(axis=1)
    radii = np.array([np.linalg.norm(points[label == i] - c, axis=1).max(initial=0.01) for i, c in enumerate(centers)])
    return centers, radii


def split_in_two(centers: np.ndarray, radii: np.ndarray, rng: np.random.Generator):
    """One more sphere: the largest becomes two, half its radius apart."""
    largest = radii.argmax()
    shift = rng.normal(size=3)
    shift *= 0.25 * radii[largest] / np.linalg.norm(shift)
    more = np.vstack([centers, centers[largest] + shift])
    more[largest] -= shift
    return more, np.append(radii, radii[largest])


def fit_link(dense, coarse, probes, count, starts, previous, rng):
    """Best of several starts: (mean bulge, centers, radii)."""
    loss = CoverLoss(coarse, probes)
    best = None
    steps = 500
    for start in range(starts):
        if start > 0 and start == starts - 1 and previous is not None:
            centers, radii = split_in_two(*previous[1:], rng)
        else:
            centers, radii = start_by_clusters(coarse, count, rng)
        centers, radii = descend(loss, centers, radii, np.geomspace(3e2, 3e6, steps), np.geomspace(2e-3, 5e-5, steps))
        radii = repaired(dense, centers, radii)
        bulge = loss(centers, radii, 0.0)[0]
        if best is None or bulge < best[0]:
            best = (bulge, centers, radii)
    return best


class RefusedShare:
    """Step 4: the share of truly free configurations that the sphere pairs refuse, smoothed, plus the price of gaps.

    A configuration counts sigmoid(-clearance / width), clearance the smallest ||c_i - c_j|| - r_i - r_j of its pairs.
    """

    def __init__(self, poses: np.ndarray, link: np.ndarray, surfaces: list[np.ndarray]):
        self.poses, self.link, self.surfaces = poses, link, surfaces
        i, j = np.triu_indices(len(link), 1)
        apart = np.abs(link[i] - link[j]) >= 2
        self.pairs = i[apart], j[apart]

    def clearance(self, poses: np.ndarray, centers: np.ndarray, radii: np.ndarray):
        """Smallest clearance per pose, its pair's index, and the unit vector from the pair's first to second centre."""
        first, second = self.pairs
        chosen = poses[:, self.link]
        rotations = chosen[..., :3, :3]
        world = np.einsum("nsij,sj->nsi", rotations, centers) + chosen[..., :3, 3]
        lengths = np.zeros((len(poses), len(first)))
        for axis in range(3):
            lengths += (world[:, second, axis] - world[:, first, axis]) ** 2
        lengths = np.sqrt(lengths)
        clear = lengths - radii[first] - radii[second]
        closest = clear.argmin(axis=1)
        row = np.arange(len(poses))
        away = (world[row, second[closest]] - world[row, first[closest]]) / lengths[row, closest, None]
        return clear[row, closest], closest, away, rotations

    def share(self, centers: np.ndarray, radii: np.ndarray) -> float:
        refused = 0
        for block in np.array_split(self.poses, len(self.poses) // 2000 + 1):
            refused += (self.clearance(block, centers, radii)[0] < 0).sum()
        return refused / len(self.poses)

    def loss(self, batch: np.ndarray, centers: np.ndarray, radii: np.ndarray, width: float, weight: float):
        grad_c, grad_r = np.zeros_like(centers), np.zeros_like(radii)
        clear, closest, away, rotations = self.clearance(batch, centers, radii)
        chance = 1.0 / (1.0 + np.exp(np.clip(clear / width, -50, 50)))
        slope = chance * (1.0 - chance) / width / len(batch)
        for end, sign in ((self.pairs[0][closest], 1.0), (self.pairs[1][closest], -1.0)):
            rotation = rotations[np.arange(len(batch)), end]
            np.add.at(grad_c, end, sign * slope[:, None] * np.einsum("nji,nj->ni", rotation, away))
            np.add.at(grad_r, end, slope)
        total = chance.mean()
        for k, surface in enumerate(self.surfaces):
            own = np.flatnonzero(self.link == k)
            signed, nearest, direction = depth_gradient(surface, centers[own], radii[own])
            gap = np.maximum(signed + MARGIN, 0.0)
            scale = 2 * weight * gap / len(surface)
            np.add.at(grad_c, own[nearest], -direction * scale[:, None])
            np.add.at(grad_r, own[nearest], -scale)
            total += weight * (gap**2).mean()
        return total, grad_c, grad_r


def refine(problem: RefusedShare, dense, centers, radii, steps: int, width: float, rng: np.random.Generator):
    """Step 4 from one start: (share refused, centers, radii), cover repaired."""
    widths = iter(np.geomspace(width, 0.003, steps))

    def loss(c, r, weight):
        batch = problem.poses[rng.integers(len(problem.poses), size=1500)]
        return problem.loss(batch, c, r, next(widths), weight)

    centers, radii = descend(loss, centers, radii, np.geomspace(3e4, 1e7, steps), np.geomspace(1e-3, 3e-5, steps))
    for k, points in enumerate(dense):
        own = problem.link == k
        radii[own] = repaired(points, centers[own], radii[own])
    return problem.share(centers, radii), centers, radii


def exchange(problem: RefusedShare, dense, centers, radii, rng: np.random.Generator):
    """Step 5's move: (link, centers, radii) with a sphere that is little missed gone and a costly one in two."""
    missed = np.zeros(len(radii))
    for k, points in enumerate(dense):
        own = np.flatnonzero(problem.link == k)
        signed = cdist(points, centers[own]) - radii[own]
        for column, sphere in enumerate(own):
            others = np.delete(signed, column, axis=1).min(axis=1, initial=np.inf)
            missed[sphere] = others[signed[:, column] <= 0].max(initial=0.0)
    if (missed <= 0).any():
        gone = rng.choice(np.flatnonzero(missed <= 0))
    else:
        gone = rng.choice(np.argsort(missed)[:8])
    batch = problem.poses[rng.integers(len(problem.poses), size=4000)]
    clear, closest, _, _ = problem.clearance(batch, centers, radii)
    ends = np.concatenate([problem.pairs[0][closest[clear < 0]], problem.pairs[1][closest[clear < 0]]])
    blame = np.bincount(ends, minlength=len(radii)).astype(float)
    blame[gone] = 0.0
    halved = rng.choice(len(radii), p=blame / blame.sum())
    shift = rng.normal(size=3)
    shift *= 0.25 * radii[halved] / np.linalg.norm(shift)
    link, centers, radii = problem.link.copy(), centers.copy(), radii.copy()
    link[gone], radii[gone] = link[halved], radii[halved]
    centers[gone] = centers[halved] + shift
    centers[halved] -= shift
    return link, centers, radii


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


def uncovered(corners: np.ndarray, centers: np.ndarray, radii: np.ndarray, finest: float = 3e-5) -> np.ndarray:
    """Corners (K, 3) of the pieces of triangles (T, 3, 3) that cannot be shown to lie in the balls (step 6)."""
    left = [np.empty((0, 3))]
    while len(corners):
        inside = np.linalg.norm(corners[:, :, None] - centers, axis=3) <= radii
        open_ = ~inside.all(axis=1).any(axis=1)
        corners, outside = corners[open_], ~inside[open_].any(axis=2)
        size = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1, initial=0.0)
        done = outside.all(axis=1) | (size < finest)
        left.append(corners[done].reshape(-1, 3))
        left.append(corners[~done][outside[~done]])
        # A piece with one corner outside is cut as well, so that the outermost point is found, down to 1 mm.
        a, b, c = corners[~done & ((size > 1e-3) | ~outside.any(axis=1))].transpose(1, 0, 2)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        corners = np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return np.unique(np.concatenate(left), axis=0)


def proven(meshes: list[Mesh], points: np.ndarray, centers: np.ndarray, radii: np.ndarray):
    """Radii, rounded up to 10 um, with which step 6 ends without a rest."""
    while True:
        radii = np.ceil(repaired(points, centers, radii) * 1e5) / 1e5
        rest = np.vstack([uncovered(mesh.vertices[mesh.triangles], centers, radii - MARGIN / 4) for mesh in meshes])
        if len(rest) == 0:
            return radii
        points = np.vstack([points, thinned(rest, 2e-4)])


def yaml_lines(link: np.ndarray, centers: np.ndarray, radii: np.ndarray):
    for k, name in enumerate(LINKS):
        own = np.flatnonzero(link == k)
        for i, sphere in enumerate(own[np.argsort(-(centers[own] ** 2).sum(axis=1))[::-1]]):
            x, y, z = centers[sphere] + 0.0
            place = f"center: [{x:.5f}, {y:.5f}, {z:.5f}], radius: {radii[sphere]:.5f}"
            yield f"  - {{name: {SHORT[k]}_{i}, link: {name}, {place}}}"


def first_fit(arm: Arm, probes, dense, coarse, configurations: int, starts: int, rng: np.random.Generator):
    """Steps 2 and 3: (link, centers, radii)."""
    fits, costs = [], []
    for link in range(len(LINKS)):
        weight = len(probes[link]) / configurations
        some = probes[link][rng.permutation(len(probes[link]))[:3000]]
        best: dict[int, tuple] = {}
        for count in range(1, MOST_PER_LINK + 1):
            best[count] = fit_link(dense[link], coarse[link], some, count, starts, best.get(count - 1), rng)
        fits.append(best)
        costs.append({count: weight * fit[0] for count, fit in best.items()})
        log(SHORT[link], "bulge in mm:", {count: round(float(1e3 * c), 2) for count, c in costs[-1].items()})
    numbers = split(costs, SPHERES)
    chosen = [best[count] for best, count in zip(fits, numbers)]
    return (
        np.repeat(np.arange(len(LINKS)), numbers),
        np.vstack([centers for _, centers, _ in chosen]),
        np.concatenate([radii for _, _, radii in chosen]),
    )


def read_spheres(file: Path):
    spheres = yaml.safe_load(file.read_text())["spheres"][:SPHERES]
    link = np.array([LINKS.index(sphere["link"]) for sphere in spheres])
    return link, np.array([sphere["center"] for sphere in spheres]), np.array([sphere["radius"] for sphere in spheres])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--starts", type=int, default=3, help="starts per link and number of spheres")
    parser.add_argument("--configurations", type=int, default=20000)
    parser.add_argument("--rounds", type=int, default=40, help="of step 5")
    parser.add_argument("--resume", type=Path, help="a robot file: step 5 goes on from its spheres")
    arguments = parser.parse_args()
    rng = np.random.default_rng(arguments.seed)

    arm = Arm(package_folder("airo_models") / "arms/ur5e/ur5e.urdf")
    meshes = [visual + convex for visual, convex in zip(arm.visual, arm.convex)]
    dense = [thinned(surface_points(group, 0.003), 0.0025) for group in meshes]
    coarse = [thinned(points, 0.008) for points in dense]
    free, probes = random_contacts(arm, arguments.configurations, rng)
    log(f"{len(free)} of {arguments.configurations} configurations are truly free")

    if arguments.resume:
        best = read_spheres(arguments.resume)
    else:
        best = first_fit(arm, probes, dense, coarse, arguments.configurations, arguments.starts, rng)
        _, *spheres = refine(RefusedShare(free, best[0], coarse), dense, best[1], best[2], 400, 0.02, rng)
        best = (best[0], *spheres)
    share = RefusedShare(free, best[0], coarse).share(*best[1:])
    log(f"start: {share:.2%} refused, spheres per link {np.bincount(best[0])}")
    for number in range(1, arguments.rounds + 1):
        link, centers, radii = exchange(RefusedShare(free, best[0], coarse), dense, *best[1:], rng)
        found, centers, radii = refine(RefusedShare(free, link, coarse), dense, centers, radii, 250, 0.008, rng)
        log(f"round {number}: {found:.2%} refused, spheres per link {np.bincount(link)}{' *' * bool(found < share)}")
        if found < share:
            share, best = found, (link, centers, radii)

    link, centers, radii = best
    centers = centers.round(5)
    for k, group in enumerate(meshes):
        own = link == k
        radii[own] = proven(group, surface_points(group, 0.002), centers[own], radii[own])
    log(f"cover proven: {RefusedShare(free, link, coarse).share(centers, radii):.2%} refused")
    print("spheres:", *yaml_lines(link, centers, radii), sep="\n")


if __name__ == "__main__":
    main()
