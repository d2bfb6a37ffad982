"""How far off the hand each profile leads the glass, and how high the liquid stands in it: `python bench/carrying.py`.

Needs the Python package (build/release/python on PYTHONPATH). On the hands that nothing was tuned on (hands.py), each scaled so that the
tool stays in the arm's reach. The wave is judged here (liquid.py), not by the program: zeta 0.0055; glass of radius 35 mm, height 100 mm,
filled to 90 mm; `off_mm` is that of liquids whose frequency is 5 % off. --ablation takes `carry` apart: what it does without each of its means, and with an oracle that knows the future.
"""

import argparse
import multiprocessing
import sys
import tempfile
from pathlib import Path

import numpy as np
import steadyhand
import yaml
from hands import Targets, add_arguments, hands_of
from liquid import GLASS, STEP, ZETA, frequency, spilled_share, swing

OFF = 0.95, 1.05  # frequencies of liquids that are not as the planner believes, over the glass's
PROFILES = Path(__file__).resolve().parents[1] / "profiles"


def variant(folder, name, base="carry", **changes):
    """A profile file in the folder: another one's with other keys; keys of `liquid` and `weights` one by one, None takes away."""
    profile = yaml.safe_load((PROFILES / f"{base}.yaml").read_text())
    profile["name"] = name
    for key, value in changes.items():
        if value is None:
            profile.pop(key, None)
        elif isinstance(value, dict):
            profile.setdefault(key, {}).update(value)
        else:
            profile[key] = value
    path = Path(folder) / f"{name}.yaml"
    path.write_text(yaml.safe_dump(profile))
    return str(path)


def tilt_of(profile):
    """rad, by which its target may lean."""
    path = Path(profile) if str(profile).endswith(".yaml") else PROFILES / f"{profile}.yaml"
    return np.radians(yaml.safe_load(path.read_text()).get("tilt", 180))


def follow_the_future(hand, profile, rate, robot):
    """The commands (q, dq, ddq) where the planner is told where the hand will be, not a guess of it."""
    home = robot.fk(robot.home)
    targets = Targets(hand.read(), hand.scale, tilt_of(profile), lambda t: home)
    planner = steadyhand.Planner(robot, profile)
    commands = []
    for start in np.arange(0.0, targets.t[-1], 1 / rate):
        reference, _ = targets.at(start + planner.dt * np.arange(1, planner.horizon + 1))
        commands.append(planner.follow(reference, start).at(start + np.arange(0, 1 / rate - 1e-9, STEP)))
    return [np.concatenate(parts) for parts in zip(*commands)]


def measure(job):
    hand, profile, rate, robot_name, (factor, zeta), oracle = job
    robot = steadyhand.Robot(robot_name)
    us = float("nan")
    if oracle:
        commands = follow_the_future(hand, profile, rate, robot)
    else:
        replay = steadyhand.replay(hand.path, profile, rate, robot=robot, track=hand.track, until=hand.until, scale=hand.scale)
        commands, us = (replay.commands.q, replay.commands.dq, replay.commands.ddq), float(np.median(replay.steps.solve_us))
    return {**judge(hand, tilt_of(profile), robot, commands, (factor, zeta)), "us": us}


def judge(hand, tilt, robot, commands, liquid=(1.0, ZETA)):
    """commands: q, dq, ddq (m, n), 500 a second. liquid: its frequency over the glass's, and its damping."""
    tool = robot.fk(commands[0])
    targets = Targets(hand.read(), hand.scale, tilt, lambda t: tool[min(round(t / STEP), len(tool) - 1)])
    looked = np.arange(0, len(tool), 5)
    target, engaged = targets.at(looked * STEP)
    target, tool = target[engaged], tool[looked][engaged]
    force = robot.local_acceleration(*commands)
    wave = swing(force, omega=liquid[0] * frequency(), zeta=liquid[1])[0].max()
    error = np.linalg.norm(tool[:, :3, 3] - target[:, :3, 3], axis=1)
    turn = np.einsum("kij,kij->k", tool[:, :3, :3], target[:, :3, :3])
    steps = np.abs(np.diff(commands[2], axis=0)).max(axis=1)
    return {
        "rms_mm": 1e3 * np.sqrt(np.mean(error**2)),
        "max_mm": 1e3 * error.max(),
        "turn_deg": np.degrees(np.sqrt(np.mean(np.arccos(np.clip((turn - 1) / 2, -1, 1)) ** 2))),
        "tilt_deg": np.degrees(np.arccos(np.clip(tool[:, 2, 2], -1, 1)).max()),
        "lateral": np.hypot(force[:, 0], force[:, 1]).mean(),
        "wave_mm": 1e3 * wave,
        "off_mm": 1e3 * max(swing(force, omega=factor * frequency(), zeta=liquid[1])[0].max() for factor in OFF),
        "spilled_percent": 100 * spilled_share(force) if wave > GLASS.height - GLASS.fill else 0.0,
        "step": steps.max(),
        "step_99": np.percentile(steps[steps > 1e-9], 99) if steps.any() else 0.0,
    }


LARGEST = "max_mm", "wave_mm", "off_mm", "spilled_percent", "step"


def table(found, profiles, rates, robot="ur5e", liquid=(1.0, ZETA), oracles=(), each=False):
    """Prints a row for each profile and rate, and returns {(profile, rate): one dict for each hand}."""
    jobs = [(hand, profile, rate, robot, liquid, name in oracles) for rate in rates for name, profile in profiles.items() for hand in found]
    names = [(name, rate) for rate in rates for name in profiles for _ in found]
    with multiprocessing.Pool() as pool:
        rows = pool.map(measure, jobs, chunksize=1)
    keys = list(rows[0])
    results = {}
    for (name, rate), job, row in zip(names, jobs, rows):
        results.setdefault((name, rate), []).append(row)
        if each:
            print(f"{job[0].name:44s} {name:12s} {rate:5g} Hz " + " ".join(f"{key} {row[key]:.3g}" for key in keys))
    print(f"{len(found)} hands; mean over hands, of what has brackets the largest, too\n| profile | Hz | " + " | ".join(keys) + " |\n|---|---|" + "---|" * len(keys))
    for (name, rate), group in results.items():
        mean = {key: np.mean([row[key] for row in group]) for key in keys}
        cells = [f"{mean[key]:.3g}" + (f" ({max(row[key] for row in group):.3g})" if key in LARGEST else "") for key in keys]
        print(f"| {name} | {rate:g} | " + " | ".join(cells) + " |")
    return results


def compare(results, first, others):
    """Ratios of the position errors, hand by hand."""
    for (name, rate), rows in results.items():
        if name in others and (first, rate) in results:
            ratio = [row["rms_mm"] / base["rms_mm"] for row, base in zip(rows, results[first, rate])]
            print(f"position error of {name} over that of {first}, {rate:g} Hz: mean of hands {np.mean(ratio):.2f}, largest {max(ratio):.2f}, "
                  f"of the means {np.mean([r['rms_mm'] for r in rows]) / np.mean([r['rms_mm'] for r in results[first, rate]]):.2f}")  # fmt: skip


def ablation(folder):
    return {
        "carry": "carry",
        "no_spill off": variant(folder, "no_spill-off", liquid=None),
        "with the hand's tilt": variant(folder, "tilted", tilt=180),
        "constant velocity": variant(folder, "constant-velocity", prediction="constant_velocity"),
        "one frequency": variant(folder, "one-frequency", liquid={"frequencies": [1.0, 1.0, 1.0]}),
        "margin 0": variant(folder, "margin-0", liquid={"margin": 0.0}),
        "oracle": "carry",
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.split(":")[0])
    add_arguments(parser)
    parser.add_argument("--profile", nargs="+", default=["tracking", "follow", "waiter", "carry"])
    parser.add_argument("--rate", nargs="+", type=float, default=[20.0])
    parser.add_argument("--robot", default="ur5e")
    parser.add_argument("--frequency", type=float, default=1.0, help="of the judged liquid, times the glass's: plans know the glass's")
    parser.add_argument("--damping", type=float, default=ZETA, help="of the judged liquid")
    parser.add_argument("--ablation", action="store_true")
    parser.add_argument("--each", action="store_true", help="a line for each hand")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        profiles = ablation(folder) if arguments.ablation else {Path(name).stem: name for name in arguments.profile}
        oracles = ["oracle"] if arguments.ablation else []
        results = table(hands_of(arguments), profiles, arguments.rate, arguments.robot, (arguments.frequency, arguments.damping), oracles, arguments.each)
    compare(results, "tracking", ["follow"])
    compare(results, "waiter", ["carry"])
    if arguments.ablation:
        compare(results, "no_spill off", ["carry"])


if __name__ == "__main__":
    sys.exit(main())
