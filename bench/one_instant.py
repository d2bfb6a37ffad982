"""One-instant inverse kinematics on the same hands, for comparison: `python bench/one_instant.py [--tune]`.

Needs PyPI pin-pink 4.4.0, qpsolvers, proxsuite, pin and PyYAML in an environment of its own, and the Python package
(build/release/python on PYTHONPATH). Pink as a careful user sets it up: a frame task of costs 50 (position) and 10 (orientation), the arm's
limits of position and velocity, accelerations up to 15 rad/s^2, and a barrier between the collision meshes of links that are not
neighbours. It gets the newest sample of the hand and knows nothing of what comes. The gain of its task (the share of the error that a step
takes away) and its rate decide how well it follows: --tune looks for the best on the training hands. Judged as carrying.py judges.
"""

import argparse
import itertools
import multiprocessing

import numpy as np
import pinocchio as pin
import steadyhand
from carrying import ROOT, STEP, Targets, add_arguments, find_hands, judge

URDF = "lib/python3*/site-packages/airo_models/arms/ur5e/ur5e.urdf"
ACCELERATION = 15.0  # rad/s^2
NEAREST = 8  # pairs in the barrier
GAINS, RATES = (0.05, 0.1, 0.2, 0.4), (50.0, 100.0)


def load_arm(robot):
    """The UR5e with our tool as frame `glass`, and its collision meshes, convex, in pairs that can be kept apart."""
    urdf = next((ROOT / ".deps/venv").glob(URDF))
    model = pin.buildModelFromUrdf(str(urdf))
    geometry = pin.buildGeomFromUrdf(model, str(urdf), pin.GeometryType.COLLISION, package_dirs=[str(urdf.parent)])
    wrist = model.frames[model.getFrameId("wrist_3_link")]
    tool = pin.SE3(pin.rpy.rpyToMatrix(-np.pi / 2, 0.0, 0.0), np.array([0.0, 0.0, 0.15]))
    model.addFrame(pin.Frame("glass", wrist.parentJoint, model.getFrameId("wrist_3_link"), wrist.placement * tool, pin.FrameType.OP_FRAME))
    data = model.createData()
    pin.framesForwardKinematics(model, data, robot.home)
    if not np.allclose(data.oMf[model.getFrameId("glass")].homogeneous, robot.fk(robot.home), atol=1e-4):
        raise SystemExit("this arm's tool is not that of robots/ur5e.yaml")
    for item in geometry.geometryObjects:
        if hasattr(item.geometry, "buildConvexHull"):
            item.geometry.buildConvexHull(True, "Qt")
            item.geometry = item.geometry.convex
    geometry.addAllCollisionPairs()
    seen = pin.GeometryData(geometry)
    pin.computeCollisions(model, data, geometry, seen, robot.home, False)
    for k in reversed(range(len(geometry.collisionPairs))):
        pair = geometry.collisionPairs[k]
        joints = [geometry.geometryObjects[i].parentJoint for i in (pair.first, pair.second)]
        if abs(joints[0] - joints[1]) < 2 or seen.collisionResults[k].isCollision():
            geometry.removeCollisionPair(pair)
    return model, geometry


def follow(hand, robot, gain, rate):
    """q, dq, ddq at 500 Hz, and how many steps found no solution."""
    import pink
    from pink.barriers import SelfCollisionBarrier
    from pink.limits import AccelerationLimit, ConfigurationLimit, VelocityLimit

    model, geometry = load_arm(robot)
    configuration = pink.Configuration(model, model.createData(), robot.home, collision_model=geometry, collision_data=pin.GeometryData(geometry))
    task = pink.tasks.FrameTask("glass", position_cost=50.0, orientation_cost=10.0, gain=gain)
    acceleration = AccelerationLimit(model, np.full(model.nv, ACCELERATION))
    limits = [ConfigurationLimit(model), VelocityLimit(model, robot.velocity_max), acceleration]
    barriers = [SelfCollisionBarrier(NEAREST, gain=20.0, d_min=0.005)]
    home = robot.fk(robot.home)
    targets = Targets(hand.read(), hand.scale, np.pi, lambda t: home)
    q, v, failed, step = [], np.zeros(model.nv), 0, 1 / rate
    times = np.arange(0.0, targets.t[-1], step)
    for t in times:
        newest = targets.T[np.searchsorted(targets.t, t, side="right") - 1]
        task.set_target(pin.SE3(newest))
        acceleration.set_last_integration(v, step)
        try:
            now = pink.solve_ik(configuration, [task], step, solver="proxqp", limits=limits, barriers=barriers, safety_break=False)
        except pink.exceptions.NoSolutionFound:
            now, failed = v - np.clip(v, -ACCELERATION * step, ACCELERATION * step), failed + 1
        q.append(configuration.q.copy())
        # A position that rounding leaves beyond a limit would have no solution from there on.
        inside = np.clip(configuration.q + step * now, model.lowerPositionLimit + 1e-9, model.upperPositionLimit - 1e-9)
        v = (inside - configuration.q) / step
        configuration.update(inside)
    often = np.arange(0.0, times[-1], STEP)
    q = np.array([np.interp(often, times, column) for column in np.array(q).T]).T
    dq = np.gradient(q, STEP, axis=0)
    return (q, dq, np.gradient(dq, STEP, axis=0)), failed


def measure(job):
    hand, gain, rate = job
    robot = steadyhand.Robot("ur5e")
    commands, failed = follow(hand, robot, gain, rate)
    return {**judge(hand, np.pi, robot, commands), "no_solution": failed}


def tune(pool, found):
    """Prints the mean error for each gain and rate, and returns the best two numbers."""
    errors = {}
    print(f"{len(found)} hands, mean of RMS position errors, mm\n| gain | " + " | ".join(f"{rate:g} Hz" for rate in RATES) + " |\n|---|" + "---|" * len(RATES))
    for gain, rate in itertools.product(GAINS, RATES):
        errors[gain, rate] = np.mean([row["rms_mm"] for row in pool.map(measure, [(hand, gain, rate) for hand in found], chunksize=1)])
        if rate == RATES[-1]:
            print(f"| {gain:g} | " + " | ".join(f"{errors[gain, each]:.1f}" for each in RATES) + " |", flush=True)
    return min(errors, key=errors.get)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split(":")[0])
    add_arguments(parser)
    parser.add_argument("--gain", type=float, default=0.2)
    parser.add_argument("--rate", type=float, default=100.0, help="Hz")
    parser.add_argument("--tune", action="store_true", help="look for gain and rate on the first 5 s of the training hands")
    arguments = parser.parse_args()
    with multiprocessing.Pool() as pool:
        if arguments.tune:
            arguments.gain, arguments.rate = tune(pool, find_hands([], 5.0, training=True))
        found = find_hands(arguments.recordings, arguments.seconds)
        rows = pool.map(measure, [(hand, arguments.gain, arguments.rate) for hand in found], chunksize=1)
    print(f"gain {arguments.gain:g}, {arguments.rate:g} Hz")
    for hand, row in zip(found, rows):
        print(f"{hand.name:44s} scale {hand.scale:.2f} " + " ".join(f"{key} {value:.3g}" for key, value in row.items()))
    print(f"{len(found)} hands; mean: " + ", ".join(f"{key} {np.mean([row[key] for row in rows]):.3g}" for key in rows[0]))


if __name__ == "__main__":
    main()
