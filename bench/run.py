"""`./steadyhand bench`: our solver along easy and hard sequences, the paper's own stack and other peers on a sample of its problems.

README.md says how they are compared.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path

warnings.filterwarnings("ignore", category=FutureWarning, module="casadi")

import closed_loops
from peers import PeerError
from workers import PAPER, SOLVERS

ROOT = Path(__file__).resolve().parent.parent
PROFILES = ("tracking", "anti-slosh", "waiter")
LONGEST_HORIZON = 128  # kMaxHorizon of src/steadyhand/planning/ocp
OURS = "steadyhand-realtime"  # drives the closed loops


class InputError(Exception):
    """Something the user can put right; exit code 2."""


def parse_arguments(argv):
    parser = argparse.ArgumentParser(
        prog="steadyhand bench",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="examples:\n  ./steadyhand bench --quick\n  ./steadyhand bench --profiles waiter --solvers "
        "steadyhand-fatrop casadi --json out/bench.json\n\n" + closed_loops.LEGEND,
    )
    parser.add_argument(
        "--solvers", nargs="+", metavar="NAME", default=None, help=f"of {', '.join(SOLVERS)} (default: all)"
    )
    parser.add_argument(
        "--profiles", nargs="+", metavar="NAME", default=list(PROFILES), help=f"(default: {' '.join(PROFILES)})"
    )
    parser.add_argument(
        "--quick",
        action="store_true",
        help="short loops of one horizon, and no casadi-c unless asked for",
    )
    parser.add_argument("--json", metavar="FILE", type=Path, help="write all figures")
    parser.add_argument("--sequences", nargs="+", metavar="NAME", help="(default: all)")
    parser.add_argument("--horizons", nargs="+", type=int, metavar="N", help="(default: 8 16 32 64; --quick: 8)")
    parser.add_argument("--solves", type=int, metavar="COUNT", help="of each combination (default: 2000; --quick: 500)")
    parser.add_argument("--sample", type=int, metavar="COUNT", help="of these for the peers (default: 20; --quick: 5)")
    parser.add_argument("--budget-us", type=float, default=0.0, metavar="US", help="for a solve (default: 0, none)")
    options = parser.parse_args(argv)
    if options.horizons is None:
        options.horizons = [8] if options.quick else [8, 16, 32, 64]
    if options.solves is None:
        options.solves = 500 if options.quick else 2000
    if options.sample is None:
        options.sample = min(options.solves, 5 if options.quick else 20)
    if options.solves < 1:
        raise InputError(f"--solves is {options.solves}; it must be at least 1")
    if not 1 <= options.sample <= options.solves:
        raise InputError(f"--sample is {options.sample}; it must be from 1 to --solves, {options.solves}")
    if not options.budget_us >= 0.0:
        raise InputError(f"--budget-us is {options.budget_us}; it must be 0 (none) or more")
    for horizon in options.horizons:
        if not 1 <= horizon <= LONGEST_HORIZON:
            raise InputError(f"--horizons has {horizon}; each must be from 1 to {LONGEST_HORIZON}")
    if options.solvers is None:
        options.solvers = [s for s in SOLVERS if not (options.quick and s == "casadi-c")]
    options.solvers = list(dict.fromkeys(options.solvers))
    for name in options.solvers:
        if name not in SOLVERS:
            raise InputError(f"--solvers: there is no {name!r}; there are {', '.join(SOLVERS)}")
    if options.json and not options.json.absolute().parent.is_dir():
        raise InputError(f"--json: the folder {options.json.parent} does not exist")
    return options


def run_program(program, *arguments):
    try:
        run = subprocess.run([program, *arguments], stdout=subprocess.PIPE, text=True)
    except OSError as error:
        raise InputError(
            f"the program {program} cannot be started: {error.strerror}; STEADYHAND_PROGRAM names it"
        ) from None
    if run.returncode != 0:
        raise InputError(f"`{program} {' '.join(arguments)}` ended with exit code {run.returncode}, see above")
    return run.stdout


def bench(options):
    program = os.environ.get("STEADYHAND_PROGRAM", str(ROOT / "build/release/steadyhand"))
    description = json.loads(run_program(program, "describe", "ur5e"))
    paths = {"program": program, "cache": ROOT / "build" / "bench", "acados": ROOT / ".deps" / "acados" / "acados"}
    with tempfile.TemporaryDirectory(prefix="steadyhand-bench-") as folder:
        names = [name for name in options.solvers if name != OURS]
        loops = closed_loops.run(options, description, names, PAPER, paths, Path(folder))
    if options.json:
        figures = [{**loop.figures, "peers_us": loop.peers, "peers_short": loop.short} for loop in loops]
        options.json.write_text(json.dumps({"closed_loops": figures}, indent=1) + "\n")


def main(argv):
    """Exit code: 0 done; 2 bad input or a peer that cannot be had, with the reason on stderr; 130 interrupted."""
    try:
        bench(parse_arguments(argv))
    except (InputError, PeerError) as error:
        print(f"steadyhand bench: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
