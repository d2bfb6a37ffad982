"""Two builds of the solver on the same problems: `versions.py OLD NEW FILE...`, both programs `bench_problems`.

The files are what `bench_solvers --keep` wrote. The programs take turns, file by file and round by round, and of each
problem's times the least counts, so that what else the machine does hits both alike and mostly not at all. A program
may be several words in one argument: "qemu-aarch64 -L SYSROOT build/aarch64/bench_problems".
"""

import argparse
import json
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np

HEADING = (
    f"{'problems':<32}{'count':>6}{'mean us':>18}{'ratio':>7}{'p99 us':>18}{'p99.9/mean':>12}{'iterations':>14}"
    f"{'most':>11}{'unsolved':>10}{'higher':>8}{'lower':>7}{'apart':>9}"
)
LEGEND = """\
ratio          of the means, new / old; p99.9/mean of the new
higher, lower  of the problems that both solve: the new one's objective is so by more than 1e-6 (relative)
apart          the largest relative difference of these objectives"""
LEAST_OBJECTIVE = 1e-3  # smaller ones are compared as if they were this


class InputError(Exception):
    """Something the user can put right; exit code 2."""


def solve(program, file, repetitions):
    """One object for each problem, see bench/problems.cpp."""
    command = [*shlex.split(program), "--json", "--repetitions", str(repetitions), str(file)]
    try:
        run = subprocess.run(command, stdout=subprocess.PIPE, text=True)
    except OSError as error:
        raise InputError(f"{command[0]} cannot be started: {error.strerror}") from None
    if run.returncode != 0:
        raise InputError(f"`{shlex.join(command)}` ended with exit code {run.returncode}, see above")
    answers = [json.loads(line) for line in run.stdout.splitlines()]
    if not answers:
        raise InputError(f"{file}: holds no problem")
    return answers


def solve_by_both(programs, file, rounds, repetitions):
    """What each program answers, with the least time of each problem over all rounds."""
    sides = [[], []]
    for _ in range(rounds):
        for side, program in zip(sides, programs):
            answers = solve(program, file, repetitions)
            if side:
                for known, answer in zip(side, answers, strict=True):
                    known["us"] = min(known["us"], answer["us"])
            else:
                side.extend(answers)
    names = [[problem["problem"] for problem in side] for side in sides]
    if names[0] != names[1]:
        raise InputError(f"{file}: the programs do not read the same problems from it")
    return sides


def line(name, old, new):
    """Of lists of problems with their least times."""
    times = [np.array([problem["us"] for problem in side]) for side in (old, new)]
    iterations = [np.array([problem["iterations"] for problem in side]) for side in (old, new)]
    unsolved = [sum(problem["status"] != "solved" for problem in side) for side in (old, new)]
    both = [(a["objective"], b["objective"]) for a, b in zip(old, new) if a["status"] == b["status"] == "solved"]
    apart = np.array([(b - a) / max(abs(a), LEAST_OBJECTIVE) for a, b in both])
    mean, p99 = [t.mean() for t in times], [np.percentile(t, 99) for t in times]
    return (
        f"{name:<32}{len(old):>6}{f'{mean[0]:.1f} {mean[1]:.1f}':>18}{mean[1] / mean[0]:7.2f}"
        f"{f'{p99[0]:.1f} {p99[1]:.1f}':>18}{np.percentile(times[1], 99.9) / mean[1]:12.1f}"
        f"{f'{iterations[0].mean():.2f} {iterations[1].mean():.2f}':>14}"
        f"{f'{iterations[0].max()} {iterations[1].max()}':>11}{f'{unsolved[0]} {unsolved[1]}':>10}"
        f"{np.sum(apart > 1e-6):>8}{np.sum(apart < -1e-6):>7}{np.abs(apart).max(initial=0.0):9.0e}"
    )


def at_least_once(text):
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"is {text!r}; it must be a whole number, at least 1")
    return int(text)


def main(argv):
    """Exit code: 0 done; 2 bad input, with the reason on stderr; 130 interrupted."""
    parser = argparse.ArgumentParser(
        prog="versions.py", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter, epilog=LEGEND
    )
    parser.add_argument("old")
    parser.add_argument("new")
    parser.add_argument("files", nargs="+", type=Path)
    count = {"type": at_least_once, "default": 3, "metavar": "COUNT"}
    parser.add_argument("--rounds", **count, help="in which both have a turn (default: 3)")
    parser.add_argument("--repetitions", **count, help="solves of each problem in a turn (default: 3)")
    options = parser.parse_args(argv)
    print(HEADING)
    try:
        for file in options.files:
            sides = solve_by_both((options.old, options.new), file, options.rounds, options.repetitions)
            print(line(file.stem, *sides), flush=True)
    except InputError as error:
        print(f"versions.py: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    print(f"\n{LEGEND}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
