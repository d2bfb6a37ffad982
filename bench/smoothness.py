"""How smooth the actions are that a data set gets of the same hands: ours, Pink with its acceleration limit, placo behind a filter.

`python bench/smoothness.py [RECORDING...]`, in an environment of its own with PyPI pin-pink 4.4.0, qpsolvers, proxsuite, placo and PyYAML, and
the Python package (build/release/python on PYTHONPATH). Each is tuned to the same tracking error: ours is the profile as it is; of Pink the
gain of its task and of placo the time constant of a first-order low-pass behind it are searched for by bisection, until the mean over the hands
of the RMS position error is ours, within 3 %. Pink is set up as in one_instant.py (limits of position, velocity and acceleration, 15 rad/s^2, a
barrier between links); placo solves each instant with limits of position and velocity, as its examples do.

Definitions. An action is the joints' position commanded for the end of a frame of 1/30 s (docs/how-to/record-data.md, --action joints).
step: its largest change from one frame to the next, of any joint, rad. bend: the largest change of that change, as an acceleration (times fps^2),
rad/s^2. jumps: the share of frames in which a joint bends by more than 15 rad/s^2, the acceleration that all are told to keep. jerk: RMS and
largest third difference of the commands at 500 Hz (times 500^3), over joints, rad/s^3, after a moving mean over 10 ms, which takes rounding away.
"""

import argparse
import multiprocessing

import numpy as np
import pinocchio as pin
import steadyhand
from hands import Targets, add_arguments, hands_of
from liquid import STEP
from one_instant import ACCELERATION, ROOT, URDF, follow

FPS = 30
RATE = 100.0  # Hz, of the peers
CLOSE = 0.03  # of the tracking error


def targets_of(hand, robot):
    home = robot.fk(robot.home)
    return Targets(hand.read(), hand.scale, np.pi, lambda t: home)


def ours(hand, robot, profile, rate):
    done = steadyhand.replay(hand.path, profile, rate, robot=robot, track=hand.track, until=hand.until, scale=hand.scale)
    return done.commands.q


def placo_filtered(hand, robot, constant):
    """Joints at 500 Hz: placo's solution of each instant at RATE, through a low-pass with this time constant (s)."""
    import placo

    urdf = next((ROOT / ".deps/venv").glob(URDF))
    model = placo.RobotWrapper(str(urdf), placo.Flags.ignore_collisions)
    for name, value in zip(robot.joint_names, robot.home):
        model.set_joint(name, value)
    model.update_kinematics()
    solver = placo.KinematicsSolver(model)
    solver.mask_fbase(True)
    solver.dt = 1 / RATE
    solver.enable_velocity_limits(True)
    solver.enable_joint_limits(True)
    for name, most in zip(robot.joint_names, robot.velocity_max):
        model.set_velocity_limit(name, float(most))
    tool = np.eye(4)
    tool[:3, :3], tool[:3, 3] = pin.rpy.rpyToMatrix(-np.pi / 2, 0.0, 0.0), (0.0, 0.0, 0.15)
    off = np.linalg.inv(tool)
    task = solver.add_frame_task("wrist_3_link", robot.fk(robot.home) @ off)
    task.configure("glass", "soft", 1.0, 0.3)
    solver.add_regularization_task(1e-4)
    targets = targets_of(hand, robot)
    times, found = np.arange(0.0, targets.t[-1], 1 / RATE), []
    for t in times:
        task.T_world_frame = targets.T[np.searchsorted(targets.t, t, side="right") - 1] @ off
        solver.solve(True)
        model.update_kinematics()
        found.append([model.get_joint(name) for name in robot.joint_names])
    often = np.arange(0.0, times[-1], STEP)
    wanted = np.array([np.interp(often, times, column) for column in np.array(found).T]).T
    share, q = 1 - np.exp(-STEP / constant), wanted.copy()
    for k in range(1, len(q)):
        q[k] = q[k - 1] + share * (wanted[k] - q[k - 1])
    return q


def commands_of(job):
    method, hand, value = job
    robot = steadyhand.Robot("ur5e")
    if method == "placo":
        return placo_filtered(hand, robot, value)
    if method == "pink":
        return follow(hand, robot, value, RATE)[0][0]
    return ours(hand, robot, method, value)


def measure(job):
    hand, robot = job[1], steadyhand.Robot("ur5e")
    q = commands_of(job)
    tool = robot.fk(q)
    targets = Targets(hand.read(), hand.scale, np.pi, lambda t: tool[min(round(t / STEP), len(tool) - 1)])
    looked = np.arange(0, len(q), 5)
    target, engaged = targets.at(looked * STEP)
    error = np.linalg.norm(tool[looked][engaged][:, :3, 3] - target[engaged][:, :3, 3], axis=1)
    frames = np.arange(0.0, (len(q) - 1) * STEP, 1 / FPS)
    actions = np.array([np.interp(frames, np.arange(len(q)) * STEP, column) for column in q.T]).T
    steps = np.diff(actions, axis=0)
    bends = np.abs(np.diff(steps, axis=0)).max(axis=1) * FPS**2
    smooth = np.array([np.convolve(column, np.full(5, 0.2), "valid") for column in q.T]).T
    jerks = np.diff(smooth, 3, axis=0) / STEP**3
    return {
        "error_mm": 1e3 * float(np.sqrt(np.mean(error**2))), "step": float(np.abs(steps).max()), "bend": float(bends.max()),
        "jumps_percent": 100 * float(np.mean(bends > ACCELERATION)), "jerk_rms": float(np.sqrt(np.mean(jerks**2))), "jerk_max": float(np.abs(jerks).max()),
    }  # fmt: skip


def tuned(pool, method, found, error, low, high):
    """Rows with the value between low, which errs less, and high for which the mean error is that of the argument, and that value
    in words; where there is none, these say so."""
    for _ in range(9):
        value = float(np.sqrt(low * high))
        rows = pool.map(measure, [(method, hand, value) for hand in found], chunksize=1)
        mean = np.mean([row["error_mm"] for row in rows])
        if abs(mean / error - 1) < CLOSE:
            return rows, f"{value:.3g}"
        low, high = (value, high) if mean < error else (low, value)
    return rows, f"{value:.3g} (NOT COMPARABLE: no value errs by {error:.1f} mm, this one by {mean:.1f})"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split(":")[0])
    add_arguments(parser)
    parser.add_argument("--profile", default="tracking")
    parser.add_argument("--rate", type=float, default=50.0, help="Hz, of our plans")
    parser.add_argument("--workers", type=int, default=2)
    arguments = parser.parse_args()
    found = hands_of(arguments)
    with multiprocessing.Pool(arguments.workers) as pool:
        mine = pool.map(measure, [(arguments.profile, hand, arguments.rate) for hand in found], chunksize=1)
        error = np.mean([row["error_mm"] for row in mine])
        results = {f"ours, {arguments.profile}, {arguments.rate:g} Hz": mine}
        print(f"{len(found)} hands, {arguments.seconds:g} s of each; mean RMS position error of ours {error:.1f} mm", flush=True)
        rows, value = tuned(pool, "pink", found, error, 0.9, 0.01)
        results[f"Pink at {RATE:g} Hz, gain {value}"] = rows
        rows, value = tuned(pool, "placo", found, error, 0.002, 0.5)
        results[f"placo at {RATE:g} Hz, low-pass of s {value}"] = rows
    keys = list(mine[0])
    print("mean over hands, in brackets the largest\n| | " + " | ".join(keys) + " |\n|---|" + "---|" * len(keys))
    for name, rows in results.items():
        print(f"| {name} | " + " | ".join(f"{np.mean([row[key] for row in rows]):.3g} ({max(row[key] for row in rows):.3g})" for key in keys) + " |")


if __name__ == "__main__":
    main()
