"""`./steadyhand bench`: our solvers, the paper's own stack and other peers on the same problems.

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
from comparison import LEGEND, as_json, compare, table
from formulation import Arm, Formulation
from kkt import Judge
from peers import PeerError, say
from workers import PAPER, SOLVERS, Worker

ROOT = Path(__file__).resolve().parent.parent
PROFILES = ("tracking", "anti-slosh", "waiter")
BLOCK = 10  # problems that one solver solves before the next has its turn
QUICK_BLOCKS = 2  # per profile
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
        "steadyhand-fatrop casadi --json out/bench.json\n  ./steadyhand bench --problems out\n\n" + LEGEND,
    )
    parser.add_argument(
        "--solvers", nargs="+", metavar="NAME", default=None, help=f"of {', '.join(SOLVERS)} (default: all)"
    )
    parser.add_argument(
        "--profiles", nargs="+", metavar="NAME", default=list(PROFILES), help=f"(default: {' '.join(PROFILES)})"
    )
    parser.add_argument(
        "--problems",
        metavar="DIR",
        type=Path,
        help="what `replay --dump-problems --out DIR` left (default: replay the bundled recording)",
    )
    parser.add_argument(
        "--quick",
        action="store_true",
        help=f"{QUICK_BLOCKS * BLOCK} problems of each profile, short closed loops, and no casadi-c unless asked for",
    )
    parser.add_argument("--json", metavar="FILE", type=Path, help="write all figures, problem by problem")
    loops = parser.add_argument_group("closed loops", "our solver along easy and hard sequences, peers on a sample")
    loops.add_argument("--only", choices=("problems", "closed-loops"), help="one part (default: both)")
    loops.add_argument("--sequences", nargs="+", metavar="NAME", help="(default: all)")
    loops.add_argument("--horizons", nargs="+", type=int, metavar="N", help="(default: 8 16 32 64; --quick: 8)")
    loops.add_argument("--solves", type=int, metavar="COUNT", help="of each combination (default: 2000; --quick: 500)")
    loops.add_argument("--sample", type=int, metavar="COUNT", help="of these for the peers (default: 20; --quick: 5)")
    loops.add_argument("--budget-us", type=float, default=0.0, metavar="US", help="for a solve (default: 0, none)")
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


def load_problems(folder, profile):
    path = folder / profile / "problems.json"
    try:
        problems = json.loads(path.read_text())
    except OSError as error:
        raise InputError(
            f"{path}: {error.strerror}; `steadyhand replay --dump-problems --out {folder}` writes it"
        ) from None
    except json.JSONDecodeError as error:
        raise InputError(f"{path}: no JSON at line {error.lineno}, column {error.colno}: {error.msg}") from None
    if not isinstance(problems, list):
        raise InputError(f"{path}: must be an array of problems, not {type(problems).__name__}")
    if not problems:
        raise InputError(f"{path}: at least one problem is wanted")
    for i, problem in enumerate(problems):
        if not isinstance(problem, dict):
            raise InputError(f"{path}: problem {i} is no object, but {problem!r}")
        for key in ("robot", "dt", "horizon", "x0", "weights", "reference", "tolerance"):
            if key not in problem:
                raise InputError(f"{path}: problem {i} has no {key!r}")
        if not isinstance(problem["robot"], str):
            raise InputError(f"{path}: problem {i}: 'robot' must be a name, not {problem['robot']!r}")
        for key in ("dt", "horizon", "tolerance"):
            if type(problem[key]) not in (int, float):
                raise InputError(f"{path}: problem {i}: {key!r} must be a number, not {problem[key]!r}")
    return problems


def check_alike(problems):
    """The peers are built once: for one robot, step, horizon and tolerance."""
    for key in ("robot", "dt", "horizon", "tolerance"):
        values = {problem[key] for problem in problems}
        if len(values) > 1:
            raise InputError(f"all problems must have the same {key!r}, not {sorted(values)}")


def select(problems, quick):
    """Blocks of consecutive problems; the quick choice is spread evenly."""
    blocks = [problems[i : i + BLOCK] for i in range(0, len(problems), BLOCK)]
    if quick and len(blocks) > QUICK_BLOCKS:
        step = len(blocks) / QUICK_BLOCKS
        blocks = [blocks[int((i + 0.5) * step)] for i in range(QUICK_BLOCKS)]
    return blocks


def run_profile(workers, judge, blocks, profile):
    """Block by block, each time another solver first, so that a drift of the machine hits all alike."""
    answers = {worker.name: [] for worker in workers}
    verdicts = {worker.name: [] for worker in workers}
    for i, block in enumerate(blocks):
        if sys.stderr.isatty():
            print(f"\r{profile}: block {i + 1} of {len(blocks)} ", end="", file=sys.stderr, flush=True)
        turn = i % len(workers)
        for worker in workers[turn:] + workers[:turn]:
            answers[worker.name] += worker.solve(block)
        # Judged in between: while this goes on no solver runs.
        for name, of_solver in answers.items():
            verdicts[name] += [judge(problem, a.x, a.u) for problem, a in zip(block, of_solver[-len(block) :])]
    if sys.stderr.isatty():
        print("\r" + " " * 60 + "\r", end="", file=sys.stderr)
    return answers, verdicts


def replayed_problems(program, options, folder):
    """Blocks of each profile's problems."""
    if options.problems is None:
        say("replaying the bundled recording for its problems")
        profiles = [argument for profile in options.profiles for argument in ("--profile", profile)]
        run_program(program, "replay", "--dump-problems", "--out", str(folder), *profiles)
    source = options.problems or folder
    return {profile: select(load_problems(source, profile), options.quick) for profile in options.profiles}


def bench_problems(workers, judge, blocks):
    """Every solver on the planner's problems of one replay."""
    results = {}
    for profile, of_profile in blocks.items():
        answers, verdicts = run_profile(workers, judge, of_profile, profile)
        rows = compare(answers, verdicts, PAPER)
        print(f"\n{profile}: {rows[0].problems} problems\n{table(rows)}", flush=True)
        results[profile] = as_json(rows, answers, verdicts)
    print(f"\n{LEGEND}")
    return results


def bench(options):
    program = os.environ.get("STEADYHAND_PROGRAM", str(ROOT / "build/release/steadyhand"))
    with tempfile.TemporaryDirectory(prefix="steadyhand-bench-") as folder:
        results = bench_against_peers(program, options, Path(folder))
    if options.json:
        options.json.write_text(json.dumps(results, indent=1) + "\n")


def bench_against_peers(program, options, folder):
    """Problems of one replay, and closed loops."""
    blocks = replayed_problems(program, options, folder)
    problems = [problem for of_profile in blocks.values() for block in of_profile for problem in block]
    check_alike(problems)
    first = problems[0]
    description = json.loads(run_program(program, "describe", first["robot"]))
    paths = {"program": program, "cache": ROOT / "build" / "bench", "acados": ROOT / ".deps" / "acados" / "acados"}

    workers = [Worker(name, description, problems, paths) for name in options.solvers]
    for worker in workers:
        worker.wait_until_ready()
    print(
        f"{description['name']}: {len(description['spheres'])} spheres, {len(description['pairs'])} pairs; "
        f"horizon {first['horizon']} x {first['dt']} s; tolerance {first['tolerance']:g}"
    )
    results = {}
    if options.only != "closed-loops":
        judge = Judge(Formulation(Arm.from_description(description), first["dt"], first["horizon"]))
        results |= bench_problems(workers, judge, blocks)
    if options.only != "problems":
        print("\nclosed loops")
        peers = [worker for worker in workers if worker.name != OURS]
        loops = closed_loops.run(Path(program).with_name("bench_solvers"), options, peers, PAPER, folder)
        results["closed_loops"] = [{**loop.figures, "peers_us": loop.peers} for loop in loops]
    for worker in workers:
        worker.close()
    return results


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
