"""What `carry` does where the world is not as it believes: `python bench/robustness.py`.

Needs the Python package (build/release/python on PYTHONPATH). On the hands that nothing was tuned on (hands.py), judged as carrying.py
judges: another frequency or damping of the liquid, another fill than the planner is told, a network that stalls for 80 ms every 0.45 s,
a hand that is lost and found, tilt and profile switched at random moments. Of switched profiles the wave counts from 2 s after `carry`
began; before that what stands over the rim spills, which leaves a wave as high as the rim.
"""

import argparse
import multiprocessing
from pathlib import Path

import numpy as np
import steadyhand
import yaml
from carrying import PROFILES, tilt_of
from hands import add_arguments, hands_of
from liquid import GLASS, STEP, ZETA, frequency, swing

CASES = {
    "as believed": {},
    "frequency 5 % lower": {"factor": 0.95},
    "frequency 3 % lower": {"factor": 0.97},
    "frequency 1.5 % higher": {"factor": 1.015},
    "frequency 5 % higher": {"factor": 1.05},
    "damping 0.03": {"zeta": 0.03},
    "damping 0.08": {"zeta": 0.08},
    "filled 5 mm higher": {"fill": GLASS.fill + 0.005},
    "filled 5 mm lower": {"fill": GLASS.fill - 0.005},
    "stalls of 80 ms": {"stalls": 0.08},
    "hand lost and found": {"lost": True},
    "tilt switched": {"switched": "tilt"},
    "profile switched": {"switched": "profile"},
}
EVERY = 0.45  # s, between stalls
SETTLED = 2.0  # s


def weights(profile):
    terms = {"position": 0.0, "orientation": 0.0, "velocity": 0.0, "acceleration": 0.0, "lateral": 0.0, "vertical": 0.0}
    return {**terms, **yaml.safe_load((PROFILES / f"{profile}.yaml").read_text())["weights"]}


class Switches:
    """What an operator sets at random moments, some 0.3 to 2 s apart."""

    def __init__(self, kind, arm, random):
        self.kind, self.arm, self.random = kind, arm, random
        self.next, self.spares_since = (random.uniform(0.5, 2.0) if kind else np.inf), -np.inf

    def step(self, t):
        """Whether the liquid has been spared for long enough to count."""
        if t >= self.next:
            self.next = t + self.random.uniform(0.3, 2.0) * (1 if self.kind == "tilt" else 2)
            if self.kind == "tilt":
                self.arm.set_tilt(self.random.uniform(0.0, np.radians(45)))
            else:
                profile = self.random.choice(["carry", "carry", "waiter", "tracking"])
                spares = profile == "carry"
                self.arm.set_weights(weights(profile))
                self.arm.set_tilt(tilt_of(profile))
                self.arm.set_no_spill(bool(spares))
                if not spares:
                    self.spares_since = np.inf
                elif self.spares_since == np.inf:
                    self.spares_since = t
        return t > self.spares_since + SETTLED


def arrivals(t, stalls):
    """When each sample is heard of: with stalls those of an interval come together at its end."""
    if not stalls:
        return t
    phase = t % EVERY
    return np.where(phase < stalls, t - phase + stalls, t)


def measure(job):
    hand, profile, rate, seed, case = job
    random = np.random.default_rng(seed)
    robot = steadyhand.Robot("ur5e")
    arm = steadyhand.Pipeline(robot, profile, rate=rate, scale=hand.scale)
    recorded = hand.read()
    t = np.asarray(recorded.t) - recorded.t[0]
    heard = arrivals(t, case.get("stalls"))
    held = np.asarray(recorded.clutch, bool) & np.asarray(recorded.tracked, bool)
    if case.get("lost"):
        begin = np.cumsum(random.uniform(0.5, 2.5, 20))
        for since, until in zip(begin, begin + random.uniform(0.05, 0.6, 20)):
            held &= (t < since) | (t > until)
    switches = Switches(case.get("switched"), arm, random)
    commands, counts, fed = [], [], 0
    for now in np.arange(0.0, t[-1], STEP):
        while fed < len(t) and heard[fed] <= now:
            arm.feed(recorded.T_operator_hand[fed], t[fed], bool(held[fed]))
            fed += 1
        counts.append(switches.step(now))
        commands.append(arm.update(now))
    force = robot.local_acceleration(*(np.array(part) for part in zip(*commands)))
    glass = GLASS._replace(fill=case.get("fill", GLASS.fill))
    liquid = {"omega": case.get("factor", 1.0) * frequency(glass), "zeta": case.get("zeta", ZETA), "glass": glass}
    highest, state, rim = 0.0, None, glass.height - glass.fill
    for i, counted in enumerate(counts):
        (height,), state = swing(force[i : i + 1], state, **liquid)
        if counted:
            highest = max(highest, height)
        elif height > rim:
            state = tuple(rim / height * number for number in state)
    return 1e3 * highest, 1e3 * rim


def main():
    parser = argparse.ArgumentParser(description=__doc__.split(":")[0])
    add_arguments(parser)
    parser.add_argument("--profile", default="carry")
    parser.add_argument("--rate", nargs="+", type=float, default=[20.0, 500.0])
    parser.add_argument("--case", nargs="+", choices=list(CASES), default=list(CASES))
    arguments = parser.parse_args()
    found = hands_of(arguments)
    print(f"{len(found)} hands, {Path(arguments.profile).stem}\n| case | Hz | wave, mean, mm | largest, mm | to the rim, mm | hands over it |\n|---|---|---|---|---|---|")
    with multiprocessing.Pool() as pool:
        for name in arguments.case:
            for rate in arguments.rate:
                rows = np.array(pool.map(measure, [(hand, arguments.profile, rate, seed, CASES[name]) for seed, hand in enumerate(found)], chunksize=1))
                print(f"| {name} | {rate:g} | {rows[:, 0].mean():.1f} | {rows[:, 0].max():.1f} | {rows[0, 1]:g} | {int((rows[:, 0] > rows[:, 1]).sum())} |", flush=True)


if __name__ == "__main__":
    main()
