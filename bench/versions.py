"""Two builds of the solver on the same problems: `versions.py OLD NEW FILE...`, both programs `bench_problems`.

The files are what `bench_solvers --keep` wrote. The programs take turns, file by file and round by round, and of each
problem's times the least counts, so that what else the machine does hits both alike and mostly not at all.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path

import numpy as np

HEADING = (
    f"{'problems':<32}{'count':>6}{'mean us':>18}{'ratio':>7}{'p99 us':>18}{'p99.9/mean':>12}{'iterations':>14}"
    f"{'most':>11}{'unsolved':>10}{'higher':>8}{'lower':>7}"
)


def solve(program, file, repetitions):
    """One object for each problem, see bench/problems.cpp."""
    command = [program, "--json", "--repetitions", str(repetitions), str(file)]
    run = subprocess.run(command, stdout=subprocess.PIPE, text=True)
    if run.returncode != 0:
        raise SystemExit(f"versions: `{' '.join(command)}` ended with exit code {run.returncode}")
    return [json.loads(line) for line in run.stdout.splitlines()]


def line(name, old, new):
    """Of lists of problems with their least times."""
    times = [np.array([problem["us"] for problem in side]) for side in (old, new)]
    iterations = [np.array([problem["iterations"] for problem in side]) for side in (old, new)]
    unsolved = [sum(problem["status"] != "solved" for problem in side) for side in (old, new)]
    both = [(a, b) for a, b in zip(old, new) if a["status"] == b["status"] == "solved"]
    band = [1e-6 * max(abs(a["objective"]), 1e-3) for a, _ in both]
    higher = sum(b["objective"] > a["objective"] + e for (a, b), e in zip(both, band))
    lower = sum(b["objective"] < a["objective"] - e for (a, b), e in zip(both, band))
    mean, p99 = [t.mean() for t in times], [np.percentile(t, 99) for t in times]
    return (
        f"{name:<32}{len(old):>6}{f'{mean[0]:.1f} {mean[1]:.1f}':>18}{mean[1] / mean[0]:7.2f}"
        f"{f'{p99[0]:.1f} {p99[1]:.1f}':>18}{np.percentile(times[1], 99.9) / mean[1]:12.1f}"
        f"{f'{iterations[0].mean():.2f} {iterations[1].mean():.2f}':>14}"
        f"{f'{iterations[0].max()} {iterations[1].max()}':>11}{f'{unsolved[0]} {unsolved[1]}':>10}{higher:>8}{lower:>7}"
    )


def main(argv):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old")
    parser.add_argument("new")
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--rounds", type=int, default=3, help="in which both have a turn (default: 3)")
    parser.add_argument("--repetitions", type=int, default=3, help="solves of each problem in a turn (default: 3)")
    options = parser.parse_args(argv)
    print(HEADING)
    for file in options.files:
        sides = [[], []]
        for _ in range(options.rounds):
            for side, program in zip(sides, (options.old, options.new)):
                answers = solve(program, file, options.repetitions)
                if side:
                    for known, answer in zip(side, answers):
                        known["us"] = min(known["us"], answer["us"])
                else:
                    side.extend(answers)
        print(line(file.stem, *sides), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
