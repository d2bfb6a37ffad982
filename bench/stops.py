"""How often a stop at a random moment spills, by kind: `python bench/stops.py [RECORDING ...] [--profile carry] [--stops 2000]`.

Needs the Python package (build/release/python on PYTHONPATH). From one motion many stops branch: "lost" follows the plan to its end, as
when no further plan comes; "straight" brakes all joints evenly at the arm's limits, as a protective stop does. The wave is judged as in
carrying.py, from the commands before the stop to 2 s after it.
"""

import argparse
import multiprocessing
from pathlib import Path

import numpy as np
import steadyhand
from carrying import BUNDLED, FILL, G, HEIGHT, OMEGA, RADIUS, SHARE, ZETA, hands

STEP = 1 / 500  # s


def swing(x, v, force):
    """m: the highest wave over these specific forces (m, 3), one a STEP, from the mode's deflection and rate; and both at their end."""
    highest = 0.0
    for f in force:
        v = v + STEP * (OMEGA**2 * (f[:2] - f[2] / G * x) - 2 * ZETA * OMEGA * v)
        x = x + STEP * v
        highest = max(highest, RADIUS / G * np.hypot(*(SHARE * x + (1 - SHARE) * f[:2])))
    return highest, x, v


def straight(robot, q, dq):
    """The motion of joints that brake evenly at the limits, and stand for 2 s."""
    time = max(np.max(np.abs(dq) / robot.acceleration_max), STEP)
    t = np.arange(STEP, time + 2.0, STEP)
    left = np.clip(1 - t / time, 0, None)[:, None]
    gone = np.minimum(t, time)[:, None]
    return q + gone * (1 - 0.5 * gone / time) * dq, left * dq, np.where(left > 0, -dq / time, 0.0)


def stop_all(job):
    name, path, track, start, until, profile, rate, scale, stops = job
    robot = steadyhand.Robot("ur5e")
    arm = steadyhand.Pipeline(robot, profile, rate=rate, scale=scale)
    hand = steadyhand.read_recording(path, track=track)
    times = np.sort(np.random.default_rng(1).uniform(1.0, until - start, stops))
    x, v, fed, stop, waves = np.zeros(2), np.zeros(2), 0, 0, {"lost": [], "straight": []}
    for t in np.arange(0.0, times[-1] + STEP, STEP):
        while fed < len(hand.t) and hand.t[fed] <= t:
            arm.feed(hand.T_operator_hand[fed], hand.t[fed], bool(hand.clutch[fed]))
            fed += 1
        q, dq, ddq = arm.update(t)
        _, x, v = swing(x, v, robot.local_acceleration(q, dq, ddq)[None])
        while stop < len(times) and times[stop] <= t:
            plan = arm.plan
            along = plan.at(np.arange(t + STEP, plan.end + 2.0, STEP))
            for kind, motion in (("lost", along), ("straight", straight(robot, q, dq))):
                waves[kind].append(swing(x, v, robot.local_acceleration(*motion))[0])
            stop += 1
    return name, waves


def main():
    parser = argparse.ArgumentParser(description=__doc__.split(":")[0])
    parser.add_argument("recordings", nargs="*", type=Path)
    parser.add_argument("--profile", nargs="+", default=["tracking", "waiter", "carry"])
    parser.add_argument("--rate", type=float, default=20.0)
    parser.add_argument("--scale", type=float, default=0.5)
    parser.add_argument("--stops", type=int, default=2000)
    arguments = parser.parse_args()
    found = list(hands(arguments.recordings or sorted(BUNDLED.glob("machinima_tests/recordings/*.json")), 20.0))
    jobs = [(*hand, profile, arguments.rate, arguments.scale, -(-arguments.stops // len(found))) for profile in arguments.profile for hand in found]
    with multiprocessing.Pool() as pool:
        results = list(zip(jobs, pool.map(stop_all, jobs, chunksize=1)))
    print("| profile | stop | stops | spilled | wave, median, mm | 99 % | largest |\n|---|---|---|---|---|---|---|")
    for profile in arguments.profile:
        for kind in ("lost", "straight"):
            waves = 1e3 * np.concatenate([w[kind] for job, (_, w) in results if job[5] == profile])
            spilled = np.mean(waves > 1e3 * (HEIGHT - FILL))
            print(f"| `{Path(profile).stem}` | {kind} | {len(waves)} | {100 * spilled:.2f} % | {np.median(waves):.1f} | {np.percentile(waves, 99):.1f} | {waves.max():.1f} |")


if __name__ == "__main__":
    main()
