"""How often a stop at a random moment spills, by kind: `python bench/stops.py [--profile carry] [--stops 10000] [--speed 0.25]`.

Needs the Python package (build/release/python on PYTHONPATH), and fork(). From one motion of each hand (carrying.py) many stops branch, each
in a process of its own:
- soft: the hand lets go. The planner brings the arm to rest with the weights that a live session has then (src/steadyhand/session/live),
  and turned as the hand was last, where a live session leaves it facing as it does.
- lost: no further plan comes, and the arm follows the last one to its end.
- straight: all joints brake evenly, as hard as the limits allow, as a protective stop does.
The wave is judged as in carrying.py, from the commands before the stop to 2 s after the arm stands; the way is the distance of the
glass from its place at the stop to its last place. --speed is the share of the arm's limits, as the program's option of that name.
The last line has the speeds of the glass at the moment of the stop.
"""

import argparse
import multiprocessing
import os
from pathlib import Path

import numpy as np
import steadyhand
from carrying import GLASS, STEP, add_arguments, find_hands, swing

KINDS = "soft", "lost", "straight"
AFTER = 2.0  # s
SOFT = 3.0  # s, in which a soft stop must be at rest


def straight(robot, q, dq):
    """q, dq, ddq of joints that brake evenly at the limits, and stand."""
    time = max(np.max(np.abs(dq) / robot.acceleration_max), STEP)
    t = np.arange(STEP, time + AFTER, STEP)
    left = np.clip(1 - t / time, 0, None)[:, None]
    gone = np.minimum(t, time)[:, None]
    return q + gone * (1 - 0.5 * gone / time) * dq, left * dq, np.where(left > 0, -dq / time, 0.0)


def soft(arm, hand, t):
    """The same of a planner that is to bring the arm to rest."""
    weights = arm.weights
    at_rest = {"position": 0.0, "orientation": 50.0, "velocity": 40.0, "lateral": max(10.0, weights["lateral"][0])}
    arm.set_weights(at_rest)
    arm.feed(hand, t, False)
    return [np.array(part) for part in zip(*(arm.update(t + STEP * (i + 1)) for i in range(round((SOFT + AFTER) / STEP))))]


def branch(act):
    """act() in a copy of this process: the two floats that it returns."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        os.write(write, np.float64(act()).tobytes())
        os._exit(0)
    os.close(write)
    answer = os.read(read, 16)
    os.close(read)
    os.waitpid(child, 0)
    return np.frombuffer(answer) if len(answer) == 16 else np.full(2, np.nan)


def stop_all(job):
    hand, profile, rate, stops, share = job
    robot = steadyhand.Robot("ur5e")
    limits = {} if share == 1 else {"velocity_scale": share, "acceleration_scale": share}
    arm = steadyhand.Pipeline(robot, profile, rate=rate, scale=hand.scale, **limits)
    recorded = hand.read()
    t = np.asarray(recorded.t) - recorded.t[0]
    times = np.sort(np.random.default_rng(1).uniform(1.0, t[-1] - 0.1, stops))
    state = None
    fed, stops_of = 0, {kind: [] for kind in (*KINDS, "speed")}  # m: highest wave, and the way of the glass; m/s: its speed
    last = 0
    for now in np.arange(0.0, times[-1] + STEP, STEP):
        while fed < len(t) and t[fed] <= now:
            arm.feed(recorded.T_operator_hand[fed], t[fed], bool(recorded.clutch[fed]))
            fed += 1
        q, dq, ddq = arm.update(now)
        _, state = swing(robot.local_acceleration(q, dq, ddq)[None], state=state)
        while last < stops and times[last] <= now:
            plan = arm.plan
            highest = lambda motion: swing(robot.local_acceleration(*motion), state=state)[0]
            place = lambda joints: robot.fk(joints)[:3, 3]
            stops_of["speed"].append(np.linalg.norm(place(q + STEP * dq) - place(q)) / STEP)
            judged = lambda motion: (highest(motion), np.linalg.norm(place(motion[0][-1]) - place(q)))
            for kind, motion in (
                ("lost", plan.at(np.arange(now + STEP, plan.end + AFTER, STEP))),
                ("straight", straight(robot, q, dq)),
            ):
                stops_of[kind].append(judged(motion))
            stops_of["soft"].append(branch(lambda: judged(soft(arm, recorded.T_operator_hand[fed - 1], now))))
            last += 1
    return stops_of


def main():
    parser = argparse.ArgumentParser(description=__doc__.split(":")[0])
    add_arguments(parser)
    parser.add_argument("--profile", nargs="+", default=["tracking", "waiter", "carry"])
    parser.add_argument("--rate", type=float, default=20.0)
    parser.add_argument("--stops", type=int, default=3400, help="of each kind")
    parser.add_argument("--speed", type=float, default=1.0, help="share of the arm's limits")
    arguments = parser.parse_args()
    found = find_hands(arguments.recordings, arguments.seconds)
    jobs = [(hand, profile, arguments.rate, -(-arguments.stops // len(found)), arguments.speed) for profile in arguments.profile for hand in found]
    with multiprocessing.Pool() as pool:
        results = list(zip(jobs, pool.map(stop_all, jobs, chunksize=1)))
    print("| profile | stop | stops | spilled | wave, median, mm | 99 % | largest | way, median, mm | 99 % | largest |\n|---|---|---|---|---|---|---|---|---|---|")
    for profile in arguments.profile:
        for kind in KINDS:
            waves, ways = 1e3 * np.concatenate([seen[kind] for job, seen in results if job[1] == profile]).T
            spilled = np.mean(waves > 1e3 * (GLASS.height - GLASS.fill))
            print(
                f"| `{Path(profile).stem}` | {kind} | {len(waves)} | {100 * spilled:.2f} % | {np.median(waves):.1f} | {np.percentile(waves, 99):.1f} | {waves.max():.1f} "
                f"| {np.median(ways):.0f} | {np.percentile(ways, 99):.0f} | {ways.max():.0f} |"
            )
    speeds = np.concatenate([seen["speed"] for _, seen in results])
    print(f"speed of the glass at the stop: {np.median(speeds):.2f} m/s median, {np.percentile(speeds, 99):.2f} at 99 %, {speeds.max():.2f} largest")


if __name__ == "__main__":
    main()
