"""`realtime` beside FATROP on problems of recorded hands, the liquid among them: `python bench/beside_fatrop.py`.

Needs the Python package (build/release/python on PYTHONPATH) and the program (STEADYHAND_PROGRAM). The problems are what the planner
solved on the hands of hands.py (`replay --dump-problems`), evenly drawn; both solvers begin from the identical guess. An objective is the
same within a relative 1e-4, of those below 1e-3 as if they were 1e-3. FATROP is stopped after 20 s, as it may go on without end where a
liquid diverges. Times are the planner's own, warm, in replays of the same hands, profiles turn by turn: of each solve the least of some
repetitions.
"""

import argparse
import json
import os
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import steadyhand
from hands import add_arguments, hands_of

PROGRAM = os.environ.get("STEADYHAND_PROGRAM", "build/release/steadyhand")
GOOD = "solved", "feasible"


def solve(problems, solver, folder, seconds=None):
    """What the program says of each; None where it does not end."""
    path = Path(folder) / "asked.json"
    path.write_text(json.dumps(problems))
    try:
        done = subprocess.run([PROGRAM, "solve", "--solver", solver, str(path)], capture_output=True, text=True, timeout=seconds, check=True)
    except subprocess.TimeoutExpired:
        if len(problems) == 1:
            return [None]
        half = len(problems) // 2
        return solve(problems[:half], solver, folder, seconds) + solve(problems[half:], solver, folder, seconds)
    answer = json.loads(done.stdout)
    return answer if isinstance(answer, list) else [answer]


def drawn(hands, profile, count, rate, folder):
    """Problems of the hands under a profile, alike many of each."""
    problems, each = [], -(-count // len(hands))
    for i, hand in enumerate(hands):
        out = Path(folder) / f"{profile}-{i}"
        command = [PROGRAM, "replay", hand.path, "--profile", profile, "--rate", str(rate), "--scale", str(hand.scale), "--until", str(hand.until),
                   "--dump-problems", "--out", str(out)]  # fmt: skip
        subprocess.run(command + (["--track", hand.track] if hand.track else []), check=True, capture_output=True)
        (path,) = out.glob("*/problems.json")
        found = json.loads(path.read_text())
        problems += [found[k] for k in np.unique(np.linspace(0, len(found) - 1, each).astype(int))]
    return problems[:count]


def warm_times(hands, profiles, rate, repetitions):
    """us, of each solve of the planner: {profile: (k,)}."""
    robot, times = steadyhand.Robot("ur5e"), {profile: [] for profile in profiles}
    for hand in hands:
        least = {}
        for _ in range(repetitions):
            for profile in profiles:
                run = steadyhand.replay(hand.path, profile, rate, robot=robot, track=hand.track, until=hand.until, scale=hand.scale)
                us = np.asarray(run.steps.solve_us)
                least[profile] = np.minimum(least.get(profile, np.inf), us)
        for profile in profiles:
            times[profile].append(least[profile])
    return {profile: np.concatenate(parts) for profile, parts in times.items()}


def main():
    parser = argparse.ArgumentParser(description=__doc__.split(":")[0])
    add_arguments(parser)
    parser.add_argument("--profile", nargs="+", default=["carry", "waiter"])
    parser.add_argument("--count", type=int, default=1000, help="problems of each profile")
    parser.add_argument("--rate", type=float, default=20.0)
    parser.add_argument("--times", nargs="*", type=float, default=[20.0, 500.0], help="planning rates of the times")
    parser.add_argument("--repetitions", type=int, default=5, help="of the times")
    arguments = parser.parse_args()
    hands = hands_of(arguments)
    if not hands:
        parser.error("no such hand moves for long enough")
    with tempfile.TemporaryDirectory() as folder:
        problems = {profile: drawn(hands, profile, arguments.count, arguments.rate, folder) for profile in arguments.profile}
        print("| profile | problems | unsolved | of these feasible for FATROP | same | lower | higher | FATROP without a solution | largest KKT error of ours, of FATROP's |\n" + "|---" * 9 + "|")
        for profile, asked in problems.items():
            ours, theirs = solve(asked, "realtime", folder), []
            for k in range(0, len(asked), 20):
                theirs += solve(asked[k : k + 20], "fatrop", folder, 20.0)
            both = [(a, b) for a, b in zip(ours, theirs) if a["status"] in GOOD and b and b["status"] in GOOD]
            apart = np.array([(a["objective"] - b["objective"]) / max(b["objective"], 1e-3) for a, b in both])
            unsolved = [(a, b) for a, b in zip(ours, theirs) if a["status"] != "solved"]
            error = lambda answers: max(answer["kkt_error"] for answer in answers if answer and answer["status"] == "solved")
            print(f"| `{profile}` | {len(asked)} | {len(unsolved)} | {sum(bool(b) and b['status'] in GOOD for a, b in unsolved)} "
                  f"| {np.sum(abs(apart) <= 1e-4)} | {np.sum(apart < -1e-4)} | {np.sum(apart > 1e-4)} | {sum(not b or b['status'] not in GOOD for b in theirs)} "
                  f"| {error(ours):.1e}, {error(theirs):.1e} |", flush=True)  # fmt: skip
            if np.any(apart > 1e-4):
                print(f"higher by (relative): {np.sort(apart[apart > 1e-4])[::-1].round(5).tolist()[:20]}")
    print(f"\n| profile | Hz | solves | us, median | mean | over {arguments.profile[-1]}'s: median | mean |\n" + "|---" * 7 + "|")
    for rate in arguments.times:
        times = warm_times(hands, arguments.profile, rate, arguments.repetitions)
        base = times[arguments.profile[-1]]
        for profile, us in times.items():
            print(f"| `{profile}` | {rate:g} | {len(us)} | {np.median(us):.1f} | {us.mean():.1f} | {np.median(us) / np.median(base):.2f} | {us.mean() / base.mean():.2f} |", flush=True)


if __name__ == "__main__":
    main()
