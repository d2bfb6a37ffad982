"""Our solver in closed loop on easy and hard sequences (`bench_solvers`), and the peers on problems sampled from there."""

import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from formulation import Arm, Formulation
from kkt import Judge
from peers import PeerError
from workers import Worker

PERIOD_US = 2000.0  # the control loop's, which could have a new plan in each cycle
PEER_HORIZON = 8  # the peers are built for this one
VIOLATION, ERROR = 1e-6, 1e-5  # largest violation and KKT error (kkt.py) of what counts as a minimum


@dataclass
class Loop:
    """One sequence under one profile and horizon."""

    figures: dict  # as bench_solvers prints it
    peers: dict  # mean us of each on the samples
    short: dict  # how many answers of each are no minimum

    def ratio(self, peer):
        """Times of both on the sampled problems, ours the least of three solves of each."""
        return self.peers[peer] / self.figures["sampled_us"] if peer in self.peers else None


def run_loops(program, options, folder):
    """Yields the figures of each combination as it is done."""
    command = [program, "--json", "--problems", folder]
    for name, values in (
        ("sequence", options.sequences),
        ("profile", options.profiles),
        ("horizon", options.horizons),
        ("solves", [options.solves]),
        ("sample", [options.sample]),
        ("budget-us", [options.budget_us]),
    ):
        if values:
            command += [f"--{name}", *values]
    process = subprocess.Popen([str(word) for word in command], stdout=subprocess.PIPE, text=True)
    for line in process.stdout:
        yield json.loads(line)
    if process.wait() != 0:
        raise PeerError(f"`{' '.join(map(str, command))}` ended with exit code {process.returncode}, see above")


def sampled(figures, folder):
    """The problems that were sampled from a loop, for which the peers are built."""
    name = "-".join(str(figures[key]) for key in ("solver", "sequence", "profile", "horizon"))
    return json.loads((folder / f"{name}.json").read_text()) if figures["horizon"] == PEER_HORIZON else []


def run_peers(problems, workers, judge):
    """Mean time in us of each worker, and how many of its answers are no minimum, by one measure for all."""
    times, short = {}, {}
    for worker in workers:
        answers = worker.solve(problems)
        verdicts = [judge(problem, answer.x, answer.u) for problem, answer in zip(problems, answers)]
        times[worker.name] = float(np.mean([answer.time_us for answer in answers]))
        short[worker.name] = sum(not (v.violation <= VIOLATION and v.error <= ERROR) for v in verdicts)
    return times, short


def heading(peers):
    return (
        f"{'sequence':<17}{'profile':<12}{'N':>3}{'mean us':>9}{'p50':>8}{'p99':>8}{'p99.9':>9}{'worst':>9}"
        f"{'iterations':>12}{'unsolved':>9}{'infeasible':>11}{'same':>6}{'lower':>6}{'higher':>7}{'only F.':>8}"
        + "".join(f"{peer + ' /':>21}{'short':>7}" for peer in peers)
    )


def line(loop, peers):
    f = loop.figures
    ratios = "".join(f"{'-':>21}{'-':>7}" if loop.ratio(p) is None else f"{loop.ratio(p):21.0f}{loop.short[p]:7}" for p in peers)
    iterations = f"{f['iterations']:.1f} ({f['most_iterations']})"
    return (
        f"{f['sequence']:<17}{f['profile']:<12}{f['horizon']:>3}{f['mean_us']:9.1f}{f['p50_us']:8.1f}"
        f"{f['p99_us']:8.1f}{f['p999_us']:9.1f}{f['worst_us']:9.0f}{iterations:>12}{f['unsolved']:>9}"
        f"{f['infeasible']:>11}{f['same']:>6}{f['better']:>6}{f['worse']:>7}{f['only_fatrop']:>8}" + ratios
    )


LEGEND = """\
unsolved    not converged to the tolerance (infeasible: nor inside the constraints)
same, lower, higher, only F.  of the sampled problems, solved by FATROP too, from a cold start: objective within 1e-4, lower, higher than
            FATROP's, feasible for FATROP only
peer /      mean time of the peer / ours, on the sampled problems at N = 8; ours is the least of three solves of each
short       of the peer's answers, those that are no minimum: beyond a constraint, or of too large a KKT error (kkt.py)"""


def summary(loops, paper):
    """What came out over all sequences, horizon by horizon, and whether the worst solve fits the period."""
    lines = []
    for horizon in dict.fromkeys(loop.figures["horizon"] for loop in loops):
        chosen = [loop for loop in loops if loop.figures["horizon"] == horizon]
        total = {key: sum(loop.figures[key] for loop in chosen) for key in COUNTS}
        lines.append(
            f"N = {horizon}: {total['solves']} solves, {total['unsolved']} not converged, {total['infeasible']} infeasible; of "
            f"{total['compared']} compared with FATROP cold {total['same']} same, {total['better']} lower, "
            f"{total['worse']} higher, {total['only_fatrop']} feasible for FATROP only, {total['only_ours']} for ours only"
        )
        for hard, word in ((False, "nominal"), (True, "hard")):
            some = [loop for loop in chosen if loop.figures["hard"] == hard and paper in loop.peers]
            if some:
                ratios = [loop.ratio(paper) for loop in some]
                tail, worst = (min(l.peers[paper] / l.figures[key] for l in some) for key in ("p999_us", "worst_us"))
                lines.append(
                    f"  {word} sequences: the paper's stack takes {min(ratios):.0f} to {max(ratios):.0f} times our mean, "
                    f"at least {tail:.0f} times our p99.9 and {worst:.0f} times our worst"
                )
        worst = max(loop.figures["worst_us"] for loop in chosen)
        fits = "fits" if worst <= PERIOD_US else "does not fit"
        lines.append(f"  verdict: the worst solve, {worst:.0f} us, {fits} the period of {PERIOD_US:.0f} us")
    return "\n".join(lines)


COUNTS = ("solves", "unsolved", "infeasible", "compared", "same", "better", "worse", "only_fatrop", "only_ours")


def run(options, description, names, paper, paths, folder):
    """Prints table and summary; returns the loops. The loops come first: no peer runs beside them."""
    loops = []
    for figures in run_loops(Path(paths["program"]).with_name("bench_solvers"), options, folder):
        loops.append(Loop(figures, {}, {}))
        if sys.stderr.isatty():
            print(f"\rclosed loops: {len(loops)} done ", end="", file=sys.stderr, flush=True)
    if sys.stderr.isatty():
        print("\r" + " " * 40 + "\r", end="", file=sys.stderr)
    of_loops = [sampled(loop.figures, folder) for loop in loops]
    problems = [problem for of_loop in of_loops for problem in of_loop]
    workers = [Worker(name, description, problems, paths) for name in names if problems]
    for worker in workers:
        worker.wait_until_ready()
    judge = Judge(Formulation(Arm.from_description(description), problems[0]["dt"], PEER_HORIZON)) if problems else None
    print(heading(names))
    for loop, of_loop in zip(loops, of_loops):
        if of_loop:
            loop.peers, loop.short = run_peers(of_loop, workers, judge)
        print(line(loop, names), flush=True)
    for worker in workers:
        worker.close()
    print(f"\n{LEGEND}\n\n{summary(loops, paper)}")
    return loops
