"""How far off the hand each profile leads the glass, and how high the liquid stands in it: `python bench/carrying.py [RECORDING ...]`.

Needs the Python package (build/release/python on PYTHONPATH). Without arguments: the hands of the npm package super-hands, both of each
recording, their first 20 s. The wave is judged here, not by the program: x'' = w^2 (f - (a_z / g) x) - 2 zeta w x' with zeta = 0.0055
along both axes of the glass, e = (R / g) (0.837 x + 0.163 f), driven by the commands at 500 Hz. Glass: radius 35 mm, height 100 mm, filled
to 90 mm; where it is over the rim the program's liquid says how much is spilled.
"""

import argparse
import multiprocessing
import sys
from pathlib import Path

import numpy as np
import steadyhand

BUNDLED = Path(__file__).resolve().parents[1] / ".deps/node_modules/super-hands"
RADIUS, HEIGHT, FILL, G, ZETA, SHARE = 0.035, 0.1, 0.09, 9.81, 0.0055, 0.837
K = 1.8411837813 / RADIUS
OMEGA = np.sqrt(G * K * np.tanh(K * FILL))


def wave(t, f, omega=OMEGA, zeta=ZETA):
    """m, at each command: height of the first mode's plane at the wall. f: (m, 3), specific force in the glass's frame, m/s^2."""
    x, v, heights = f[0, :2].copy(), np.zeros(2), np.zeros(len(t))
    for i in range(1, len(t)):
        h = t[i] - t[i - 1]
        v += h * (omega**2 * (f[i, :2] - f[i, 2] / G * x) - 2 * zeta * omega * v)
        x += h * v
        heights[i] = RADIUS / G * np.hypot(*(SHARE * x + (1 - SHARE) * f[i, :2]))
    return heights


def measure(job):
    name, path, track, start, until, profile, rate, scale, robot, faults = job
    arm = steadyhand.Robot(robot)
    run = steadyhand.replay(path, profile, rate, robot=arm, track=track, start=start, until=until, scale=scale)
    commands, steps = run.commands, run.steps
    force = arm.local_acceleration(commands.q, commands.dq, commands.ddq)
    heights = wave(commands.t, force, faults[0] * OMEGA, faults[1])
    liquid, spilled = steadyhand.Liquid(RADIUS, HEIGHT, FILL), 0.0
    if heights.max() > HEIGHT - FILL:
        for i in range(1, len(commands.t)):
            spilled = liquid.update(commands.t[i] - commands.t[i - 1], force[i]).spilled_share
    error = np.linalg.norm(steps.T_base_tool[:, :3, 3] - steps.T_base_target[:, :3, 3], axis=1)[steps.engaged]
    tilt = np.arccos(np.clip(steps.T_base_tool[:, 2, 2], -1, 1))
    jump = np.abs(np.diff(commands.ddq, axis=0)).max()
    return name, profile, rate, {
        "rms_mm": 1e3 * np.sqrt(np.mean(error**2)),
        "max_mm": 1e3 * error.max(),
        "tilt_deg": np.degrees(tilt.max()),
        "lateral": np.hypot(force[:, 0], force[:, 1]).mean(),
        "wave_mm": 1e3 * heights.max(),
        "spilled_percent": 100 * spilled,
        "step": jump,
        "us": np.median(steps.solve_us),
        "refused": float(np.mean(steps.status == "previous")),
        "unsolved": float(np.mean(steps.status != "solved")),
    }


def hands(paths, seconds):
    """(name, path, track, start, until) of each hand that moves."""
    for path in paths:
        for track in ("",) if path.suffix == ".csv" else ("lhand", "rhand"):
            try:
                hand = steadyhand.read_recording(path, track=track)
            except steadyhand.SteadyhandError:
                continue  # has no such hand
            if len(hand.t) > 100 and np.asarray(hand.T_operator_hand)[:, :3, 3].std(0).max() > 0.01:
                yield f"{path.stem} {track}".strip(), str(path), track, 0.0, min(seconds, hand.t[-1])


def main():
    parser = argparse.ArgumentParser(description=__doc__.split(":")[0])
    parser.add_argument("recordings", nargs="*", type=Path)
    parser.add_argument("--profile", nargs="+", default=["tracking", "follow", "waiter", "carry"])
    parser.add_argument("--rate", nargs="+", type=float, default=[20.0])
    parser.add_argument("--scale", type=float, default=0.5)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--robot", default="ur5e")
    parser.add_argument("--frequency", type=float, default=1.0, help="of the judged liquid, times the glass's: plans know the glass's")
    parser.add_argument("--damping", type=float, default=ZETA, help="of the judged liquid")
    parser.add_argument("--each", action="store_true", help="a line for each hand")
    arguments = parser.parse_args()
    paths = arguments.recordings or sorted(BUNDLED.glob("machinima_tests/recordings/*.json"))
    found = list(hands(paths, arguments.seconds))
    jobs = [(*hand, profile, rate, arguments.scale, arguments.robot, (arguments.frequency, arguments.damping)) for hand in found for rate in arguments.rate for profile in arguments.profile]
    with multiprocessing.Pool() as pool:
        results = pool.map(measure, jobs, chunksize=1)
    keys = list(results[0][3])
    if arguments.each:
        for name, profile, rate, row in results:
            print(f"{name:40s} {Path(profile).stem:12s} {rate:5g} Hz " + " ".join(f"{key} {row[key]:.3g}" for key in keys))
    print(f"{len(found)} hands; mean over hands (of wave_mm and spilled_percent also the largest)\n| profile | Hz | " + " | ".join(keys) + " |\n|---|---|" + "---|" * len(keys))
    for rate in arguments.rate:
        for profile in arguments.profile:
            rows = [row for _, p, r, row in results if p == profile and r == rate]
            cells = [f"{np.mean([row[k] for row in rows]):.3g}" + (f" ({max(row[k] for row in rows):.3g})" if k in ("wave_mm", "spilled_percent", "max_mm") else "") for k in keys]
            print(f"| `{Path(profile).stem}` | {rate:g} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    sys.exit(main())
