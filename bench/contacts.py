"""Planning cycles at 500 Hz over random hands, arms, profiles and cells, judged on the meshes: `PYTHONPATH=build/release/python
python bench/contacts.py [--cycles 1000000] [--robots ur5e_fitted fr3 gen3 iiwa14 xarm7 so101] [--seed 1]`.

Each episode of 20 s has another hand (sweeps, turns, jumps and releases), profile and cell of up to 8 objects, a third of which
are carried by the tool. What is commanded is looked at by other programs' geometry: Pinocchio's kinematics of the URDF, Coal's
distances of its collision meshes and the glass to each other and to the objects. No contact between two commands can be missed: from one
distance to the next look no point of the arm goes as far as it (conservative advancement along the commands, halved between
them where the distance is less than one cycle's way).

Prints a line for each robot, and fails if a command is beyond a limit or a mesh touches what it must not.
"""

from __future__ import annotations

import argparse
import functools
import sys
import time
from collections import Counter
from typing import NamedTuple

import coal
import numpy as np
import pinocchio as pin
import steadyhand
from arm_meshes import ArmMeshes
from steadyhand import Cell, Object, Pipeline

PROFILES = ("tracking", "follow", "carry", "waiter", "anti-slosh")
RATE, EPISODE = 500.0, 20.0  # Hz, s
DEEPEST = 1e-4  # m, of a contact that is rounding
NEAR = 0.004  # m: nearer hulls are looked at by their meshes
GLASS = (0.035, 0.11)  # m, radius and height, about the tool's z
SMALL_GLASS = (0.0175, 0.055)  # so101's


def transform(T) -> coal.Transform3s:
    return coal.Transform3s(T[:3, :3], T[:3, 3])


class Solid(NamedTuple):
    """Something that may touch: on the link behind so many joints, in the tool, or (link 0) in the world."""

    name: str
    link: int
    shapes: tuple  # its hull, itself
    origin: np.ndarray  # in the frame of the link's joint, of the tool, or of the base
    in_tool: bool = False


class Meshes(ArmMeshes):
    """With how far they are from each other and from a cell's objects, and how far a motion may bring them."""

    def __init__(self, name: str):
        super().__init__(name)
        glass = coal.Cylinder(*(SMALL_GLASS if name == "so101" else GLASS))
        self.glass = Solid("the glass", self.robot.dof, (glass, glass), np.eye(4), in_tool=True)
        joints = self.robot.description["joints"]
        self.offsets = [np.linalg.norm(np.array(joint["origin"])[:3, 3]) for joint in joints]
        self.tool = np.array(self.robot.description["tool"]["origin"])
        self.move(self.robot.home)
        links = [pin.SE3.Identity(), *(self.data.oMi[joint] for joint in self.joints)]
        self.solids = [Solid(f"link {link}", link, shapes, (links[link].inverse() * self.data.oMi[joint] * placement).homogeneous)
                       for link, joint, placement, shapes in self.parts]  # fmt: skip

    def levers(self, first: Solid, second: Solid) -> np.ndarray:
        """m/rad, (n,): how far a joint moves a point of one solid as seen from the other, at most."""
        near, far = sorted((first, second), key=lambda solid: solid.link)
        shape, origin = far.shapes[0], self.tool @ far.origin if far.in_tool else far.origin
        shape.computeLocalAABB()
        length = np.linalg.norm(origin[:3, :3] @ shape.aabb_center + origin[:3, 3]) + shape.aabb_radius
        result = np.zeros(self.robot.dof)
        for joint in range(far.link - 1, near.link - 1, -1):
            result[joint] = length
            length += self.offsets[joint]
        return result

    def pairs_with(self, standing: list[Solid], carried: list[Solid]) -> list[tuple[Solid, Solid]]:
        """All that must not touch."""
        dof = self.robot.dof
        pairs = [(self.solids[a], self.solids[b]) for a, b in self.pairs]
        pairs += [(solid, there) for there in standing for solid in [*self.solids, self.glass, *carried] if solid.link > 0]
        return pairs + [(solid, held) for held, before in [(self.glass, dof - 1), *((held, dof) for held in carried)]
                        for solid in self.solids if solid.link < before]  # fmt: skip

    def frames(self, q) -> tuple[list, np.ndarray]:
        """T_base_link by the number of joints before it, and T_base_tool."""
        self.move(q)
        return [np.eye(4), *(self.data.oMi[joint].homogeneous for joint in self.joints)], self.robot.fk(q)


def distance(first: Solid, second: Solid, frames) -> float:
    """m; of the hulls where those are far apart, which is less than that of the meshes."""
    links, tool = frames
    at = [transform((tool if solid.in_tool else links[solid.link]) @ solid.origin) for solid in (first, second)]
    measure = lambda which: coal.distance(first.shapes[which], at[0], second.shapes[which], at[1], coal.DistanceRequest(), coal.DistanceResult())
    hulls = measure(0)
    return max(hulls, measure(1)) if hulls < NEAR else hulls


def random_hand(random: np.random.Generator, reach: float):
    """T_operator_hand by time, and whether the clutch is closed."""
    lengths = reach * random.uniform(0.05, 0.5, 3)
    speeds, phases = random.uniform(0.5, 5.0, (2, 3)), random.uniform(0.0, 2.0 * np.pi, (2, 3))
    turn = random.uniform(0.0, 1.0, 3) * random.choice([0.0, 1.0])
    jumps = np.sort(random.uniform(1.0, EPISODE, 3))
    offsets = np.vstack([np.zeros(3), np.cumsum(random.uniform(-0.1, 0.1, (3, 3)), axis=0)])
    released = random.uniform(2.0, EPISODE)

    def at(t: float):
        T = np.eye(4)
        angles = turn * np.sin(speeds[1] * t + phases[1])
        T[:3, :3] = pin.exp3(angles)
        T[:3, 3] = lengths * np.sin(speeds[0] * t + phases[0]) + offsets[np.searchsorted(jumps, t)]
        return T, not released < t < released + 0.5

    return at


def random_objects(random: np.random.Generator, meshes: Meshes) -> tuple[Cell, list, list]:
    """A cell around the arm at home, and as Coal has it: what stands and what is carried."""
    robot, found, standing, carried = meshes.robot, [], [], []
    home, tool = np.linalg.inv(robot.fk(robot.home)), robot.fk(robot.home)[:3, 3]
    reach = np.linalg.norm(tool) + 0.1
    for i in range(random.integers(0, 9)):
        T = np.eye(4)
        T[:3, :3] = pin.exp3(random.uniform(-1.0, 1.0, 3) * np.pi)
        T[:3, 3] = random.uniform(-1.0, 1.0, 3) * reach
        name, size = f"object {i}", random.uniform(0.02, 0.4, 3) * reach
        kind = random.integers(3)
        if random.random() < 1 / 3 and len(carried) < 2:
            T[:3, 3] = tool + random.uniform(-0.15, 0.15, 3) * reach
            size = random.uniform(0.01, 0.1, 3) * reach
        shape = [coal.Box(*size), coal.Sphere(size[0] / 2), coal.Cylinder(size[0] / 2, size[1])][kind]
        own = [lambda: Object.box(name, T, size), lambda: Object.sphere(name, T, size[0] / 2),
               lambda: Object.cylinder(name, T, radius=size[0] / 2, length=size[1])][kind]()  # fmt: skip
        hold = np.linalg.norm(T[:3, 3] - tool) < 0.27 * reach and len(carried) < 2
        try:
            clear = Cell([own]).distances(robot, robot.home)[name]
            if hold:  # kept apart from what the glass and the gripper may touch
                Cell([own]).attach(name, robot, robot.home)
        except steadyhand.SteadyhandError:
            continue
        if not hold and clear < 0.03:
            continue
        solid = Solid(name, robot.dof if hold else 0, (shape, shape), home @ T if hold else T, in_tool=hold)
        if hold and min(distance(*pair, meshes.frames(robot.home)) for pair in meshes.pairs_with([], [solid])) < 0.005:
            continue
        found.append(own)
        (carried if hold else standing).append(solid)
    # What is carried must not begin in what stands.
    if any(distance(held, there, meshes.frames(robot.home)) < 0.02 for held in carried for there in standing):
        return random_objects(random, meshes)
    cell = Cell(found)
    for held in carried:
        cell = cell.attach(held.name, robot, robot.home)
    return cell, standing, carried


def first_contact(meshes: Meshes, way: np.ndarray, standing: list[Solid], carried: list[Solid]) -> tuple[float, str]:
    """Looks along a way of configurations, (m, n). The least distance that was seen, m, and between what; negative: contact.
    Of each pair by itself: a joint that does not move one against the other takes no look."""
    least, between = np.inf, ""
    frames = functools.cache(lambda i: meshes.frames(way[i]))
    gone = np.vstack([np.zeros(way.shape[1]), np.cumsum(np.abs(np.diff(way, axis=0)), axis=0)])

    for first, second in meshes.pairs_with(standing, carried):
        levers = meshes.levers(first, second)

        def look(at) -> float:
            nonlocal least, between
            found = distance(first, second, at)
            if found < least:
                least, between = found, f"{first.name} and {second.name}"
            return found

        def look_between(a, b, da, db, depth) -> None:
            if da + db > levers @ np.abs(b - a) or depth == 0:
                return
            dm = look(meshes.frames((a + b) / 2))
            look_between(a, (a + b) / 2, da, dm, depth - 1)
            look_between((a + b) / 2, b, dm, db, depth - 1)

        path = gone @ levers
        i, d = 0, look(frames(0))
        while i + 1 < len(way):
            j = max(i + 1, int(np.searchsorted(path, path[i] + d)) - 1)
            dj = look(frames(j))
            if j == i + 1:
                look_between(way[i], way[j], d, dj, 6)
            i, d = j, dj
    return least, between


def run(name: str, cycles: int, seed: int) -> bool:
    meshes = Meshes(name)
    robot, random = meshes.robot, np.random.default_rng([seed, *name.encode()])
    limits = [np.array(robot.description[key]) for key in ("position_min", "position_max", "velocity_max", "acceleration_max")]
    done = beyond = contacts = refused = unsolved = 0
    least, between, where, begin, faults = np.inf, "", "", time.time(), Counter()
    while done < cycles:
        state = random.bit_generator.state["state"]["state"]
        cell, standing, carried = random_objects(random, meshes)
        profile, hand = random.choice(PROFILES), random_hand(random, np.linalg.norm(robot.fk(robot.home)[:3, 3]))
        pipeline = Pipeline(robot, str(profile), rate=RATE, cell=cell)
        way = []
        for k in range(int(EPISODE * RATE)):
            t = k / RATE
            T, clutch = hand(t)
            if k % 5 == 0:  # a hundred poses a second
                pipeline.feed(T, t, clutch)
            q, dq, ddq = pipeline.update(t)
            way.append(q)
            beyond += bool((q < limits[0] - 3e-6).any() or (q > limits[1] + 3e-6).any() or (abs(dq) > limits[2] + 1e-3).any()
                           or (abs(ddq) > limits[3] + 1e-2).any())  # fmt: skip
            plan = pipeline.plan
            if plan.status == "previous" and plan.fault not in ("none", "spill"):
                refused += 1
                faults[plan.fault] += 1
            unsolved += plan.status != "solved"
        done += len(way)
        smallest, what = first_contact(meshes, np.array(way), standing, carried)
        contacts += smallest < -DEEPEST
        if smallest < least:
            least, between, where = smallest, what, f"episode {done // len(way)}, {profile}, {cell!r}, state {state}"
    print(f"{name:12} {done} cycles, {beyond} beyond a limit; {contacts} of {done // int(EPISODE * RATE)} episodes with a contact of meshes, "
          f"smallest distance {1e3 * least:.2f} mm ({between}; {where}); {1e2 * refused / done:.4f} % of plans refused by the check {dict(faults) or ''}, "
          f"{1e2 * unsolved / done:.3f} % not solved to the optimum; {time.time() - begin:.0f} s", flush=True)  # fmt: skip
    return beyond == 0 and contacts == 0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split(":")[0])
    parser.add_argument("--cycles", type=int, default=1_000_000, help="over all robots")
    parser.add_argument("--robots", nargs="+", default=["ur5e_fitted", "fr3", "gen3", "iiwa14", "xarm7", "so101"])
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    good = [run(robot, arguments.cycles // len(arguments.robots), arguments.seed) for robot in arguments.robots]
    sys.exit(0 if all(good) else 1)


if __name__ == "__main__":
    main()
