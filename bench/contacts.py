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
import sys
import time
from collections import Counter

import coal
import numpy as np
import pinocchio as pin
import steadyhand
from arm_meshes import ArmMeshes
from steadyhand import Cell, Object, Pipeline, pose

PROFILES = ("tracking", "follow", "carry", "waiter", "anti-slosh")
RATE, EPISODE = 500.0, 20.0  # Hz, s
DEEPEST = 1e-4  # m, of a contact that is rounding
NEAR = 0.004  # m: nearer hulls are looked at by their meshes
GLASS = (0.035, 0.11)  # m, radius and height, about the tool's z
SMALL_GLASS = (0.0175, 0.055)  # so101's


def transform(T) -> coal.Transform3s:
    return coal.Transform3s(T[:3, :3], T[:3, 3])


class Meshes(ArmMeshes):
    """With how far they are from each other and from a cell's objects."""

    def __init__(self, name: str):
        super().__init__(name)
        self.glass = coal.Cylinder(*(SMALL_GLASS if name == "so101" else GLASS))
        tool = np.array(self.robot.description["tool"]["origin"])
        self.reach = np.linalg.norm(tool[:3, 3]) + 0.4 + sum(
            np.linalg.norm(np.array(joint["origin"])[:3, 3]) for joint in self.robot.description["joints"])  # fmt: skip

    def least(self, q, objects, carried) -> tuple[float, str]:
        """m, and between what: of parts that must not touch, and of parts and objects."""
        at, request, least, between = self.place(q), coal.DistanceRequest(), np.inf, ""

        def look(first, where, second, there, what):
            nonlocal least, between
            distance = coal.distance(first[0], where, second[0], there, request, coal.DistanceResult())
            if distance < NEAR:
                distance = max(distance, coal.distance(first[1], where, second[1], there, request, coal.DistanceResult()))
            if distance < least:
                least, between = distance, what

        for a, b in self.pairs:
            look(self.parts[a][3], at[a], self.parts[b][3], at[b], f"links {self.parts[a][0]} and {self.parts[b][0]}")
        T = self.robot.fk(q)
        objects = [(name, (shape, shape), there) for name, shape, there in objects]
        # What the tool holds, and how many joints are before the links that must not touch it.
        held = [(name, (shape, shape), transform(T @ origin), self.robot.dof) for name, shape, origin in carried]
        held.append(("the glass", (self.glass, self.glass), transform(T), self.robot.dof - 1))
        for name, shape, there in objects:
            for (link, _, _, part), where in zip(self.parts, at):
                if link > 0:
                    look(part, where, shape, there, f"link {link} and {name}")
            for other, part, where, _ in held:
                look(part, where, shape, there, f"{other} and {name}")
        for name, shape, there, before in held:
            for (link, _, _, part), where in zip(self.parts, at):
                if link < before:
                    look(part, where, shape, there, f"link {link} and {name}")
        return least, between


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
    tool = robot.fk(robot.home)[:3, 3]
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
        if hold and meshes.least(robot.home, [], [(name, shape, np.linalg.inv(robot.fk(robot.home)) @ T)])[0] < 0.005:
            continue
        found.append(own)
        (carried if hold else standing).append((name, shape, T))
    cell = Cell(found)
    for name, _, _ in carried:
        cell = cell.attach(name, robot, robot.home)
    home = np.linalg.inv(robot.fk(robot.home))
    carried = [(name, shape, home @ T) for name, shape, T in carried]
    standing = [(name, shape, transform(T)) for name, shape, T in standing]
    for name, shape, there in list(standing):  # what is carried must not begin in what stands
        if carried and min(coal.distance(s, transform(np.linalg.inv(home) @ o), shape,
                                         there, coal.DistanceRequest(), coal.DistanceResult()) for _, s, o in carried) < 0.02:  # fmt: skip
            return random_objects(random, meshes)
    return cell, standing, carried


def first_contact(meshes, way, objects, carried):
    """Looks along a way of configurations, (m, n). The least distance that was seen, m, and between what; negative: contact."""
    least, between = np.inf, ""

    def look(q):
        nonlocal least, between
        distance, what = meshes.least(q, objects, carried)
        if distance < least:
            least, between = distance, what
        return distance

    def bound(a, b):
        return meshes.reach * np.abs(b - a).sum()

    def between_two(a, b, da, db, depth):
        if da + db > bound(a, b) or depth == 0:
            return
        middle = (a + b) / 2
        dm = look(middle)
        between_two(a, middle, da, dm, depth - 1)
        between_two(middle, b, dm, db, depth - 1)

    i, d = 0, look(way[0])
    while i + 1 < len(way):
        j, gone = i + 1, bound(way[i], way[i + 1])
        while j + 1 < len(way) and gone + bound(way[j], way[j + 1]) < d:
            gone += bound(way[j], way[j + 1])
            j += 1
        dj = look(way[j])
        if j == i + 1:
            between_two(way[i], way[j], d, dj, 6)
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
        distance, what = first_contact(meshes, np.array(way), standing, carried)
        contacts += distance < -DEEPEST
        if distance < least:
            least, between, where = distance, what, f"episode {done // len(way)}, {profile}, {cell!r}, state {state}"
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
