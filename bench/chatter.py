"""Whether commands chatter where distances are not smooth: `PYTHONPATH=build/release/python python bench/chatter.py [--seconds 20]
[--robots ur5e_fitted fr3] [--profiles tracking carry]`.

At 500 Hz a hand presses the tool for so long into the edge of a box and over it, round a box's corner, along two capsules that are
parallel to the glass, and with a box in the tool flat onto the top of another. The same hand leads the arm without the object, too.

A line for each says, with what it is without the object in brackets: how often a second a joint's acceleration changes its sign by
more than DEADBAND of its limit on either side, what of the joints' velocity is above 20 Hz (RMS over joints and time, and the most),
the mean and the largest number of the solver's iterations, and the plans that were not solved to the optimum; and for what share of
the time the tool was within 2 mm of where it may be.
"""

from __future__ import annotations

import argparse
from typing import NamedTuple

import numpy as np
import steadyhand
from steadyhand import Cell, Object, Pipeline

RATE = 500.0  # Hz
SETTLED = 3.0  # s, that are not counted
DEADBAND = 0.01
CHATTER = 20.0  # Hz
NEAR = 0.002 + 0.001  # m, the planner's clearance and a little
MARGIN = 0.01  # m, of the objects


class Scene(NamedTuple):
    objects: list
    hand: object  # m, where the tool is wanted, by time, from where it is at home
    carried: str = ""


def at(p, axes=None) -> np.ndarray:
    T = np.eye(4)
    T[:3, 3] = p
    if axes is not None:
        T[:3, :3] = axes
    return T


def scenes(robot) -> dict[str, Scene]:
    tool = robot.fk(robot.home)[:3, 3]
    out = np.array([tool[0], tool[1], 0.0]) / np.hypot(tool[0], tool[1])
    up = np.array([0.0, 0.0, 1.0])
    axes = np.column_stack([out, np.cross(up, out), up])  # outwards, aside, up
    turned = axes @ np.array([[1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, np.sqrt(2.0)]]) / np.sqrt(2.0)

    def place(o, s, u):
        return tool + axes @ np.array([o, s, u])

    def hand(way):
        return lambda t: axes @ np.array(way(t)) * min(1.0, t)

    size = [0.3, 0.3, 0.1]
    beam = Object.box("beam", at(place(0.0, 0.15, -0.2), axes), size, margin=MARGIN)
    corner = Object.box("corner", at(place(0.26, 0.0, -0.2), turned), size, margin=MARGIN)
    posts = [Object.capsule(f"post {i}", at(place(0.14, s, 0.0), axes), 0.03, 0.4, margin=MARGIN) for i, s in enumerate((-0.06, 0.06))]
    top = Object.box("top", at(place(0.0, 0.0, -0.3), axes), [0.6, 0.6, 0.1], margin=MARGIN)
    tray = Object.box("tray", at(place(0.0, 0.0, -0.12), axes), [0.12, 0.12, 0.04], margin=MARGIN)
    return {
        "over an edge": Scene([beam], hand(lambda t: (0.0, 0.12 * np.sin(1.3 * t), -0.14))),
        "round a corner": Scene([corner], hand(lambda t: (0.04, 0.08 * np.sin(1.1 * t), -0.13 + 0.05 * np.sin(0.7 * t)))),
        "along capsules": Scene(posts, hand(lambda t: (0.1, 0.03 * np.sin(0.9 * t), 0.1 * np.sin(1.3 * t)))),
        "flat on a box": Scene([top, tray], hand(lambda t: (0.06 * np.sin(0.9 * t), 0.08 * np.sin(1.3 * t), -0.15)), "tray"),
    }


class Run(NamedTuple):
    reversals: float  # 1/s for each joint
    rms: float  # rad/s (m/s), above CHATTER
    most: float
    iterations: np.ndarray
    unsolved: float
    pressed: float


def run(robot, profile: str, scene: Scene, seconds: float, with_objects: bool) -> Run:
    cell = Cell([each for each in scene.objects if with_objects or each.name == scene.carried])
    if scene.carried:
        cell = cell.attach(scene.carried, robot, robot.home)
    pipeline = Pipeline(robot, profile, rate=RATE, scale=1.0, yaw=0.0, cell=cell)
    settled = int(SETTLED * RATE)
    speed, acceleration, iterations = [], [], []
    unsolved = pressed = 0
    for k in range(int(seconds * RATE)):
        t = k / RATE
        if k % 5 == 0:  # a hundred poses a second
            pipeline.feed(at(scene.hand(t)), t, True)
        q, dq, ddq = pipeline.update(t)
        if k < settled:
            continue
        speed.append(dq)
        acceleration.append(ddq)
        iterations.append(pipeline.plan.iterations)
        unsolved += pipeline.plan.status != "solved"
        if with_objects and k % 25 == 0:
            distances = cell.distances(robot, q)
            pressed += min(distances[each.name] for each in scene.objects if each.name != scene.carried) - MARGIN < NEAR
    count = len(speed)
    signs = np.where(np.abs(acceleration) > DEADBAND * robot.acceleration_max, np.sign(acceleration), 0.0)
    reversals = 0
    for joint in signs.T:
        kept = joint[joint != 0.0]
        reversals += np.count_nonzero(kept[1:] != kept[:-1])
    dq = np.array(speed)
    dq -= np.linspace(dq[0], dq[-1], count)  # so that its ends meet
    spectrum = np.fft.rfft(dq, axis=0)
    spectrum[np.fft.rfftfreq(count, 1.0 / RATE) <= CHATTER] = 0.0
    rough = np.fft.irfft(spectrum, count, axis=0)[int(0.2 * RATE) : -int(0.2 * RATE)]
    return Run(reversals / (count / RATE) / robot.dof, np.sqrt(np.mean(rough**2)), np.abs(rough).max(), np.array(iterations),
               unsolved / count, pressed / (count / 25))  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split(":")[0])
    parser.add_argument("--robots", nargs="+", default=["ur5e_fitted", "fr3"])
    parser.add_argument("--profiles", nargs="+", default=["tracking", "carry"])
    parser.add_argument("--seconds", type=float, default=20.0)
    arguments = parser.parse_args()
    if not arguments.seconds > SETTLED + 1.0:
        parser.error(f"--seconds must be more than {SETTLED + 1.0:g}")
    for name in arguments.robots:
        robot = steadyhand.Robot(name)
        for profile in arguments.profiles:
            for what, scene in scenes(robot).items():
                near, free = (run(robot, profile, scene, arguments.seconds, there) for there in (True, False))
                print(f"{name:12} {profile:9} {what:15} reversals {near.reversals:.2f} ({free.reversals:.2f}) 1/s, "
                      f"above {CHATTER:g} Hz {1e3 * near.rms:.3f} ({1e3 * free.rms:.3f}), at most {1e3 * near.most:.2f} ({1e3 * free.most:.2f}) mrad/s, "
                      f"iterations {near.iterations.mean():.2f} ({free.iterations.mean():.2f}), at most {near.iterations.max()} ({free.iterations.max()}), "
                      f"unsolved {1e2 * near.unsolved:.2f} ({1e2 * free.unsolved:.2f}) %, pressed {1e2 * near.pressed:.0f} %", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
