#!/usr/bin/env python3
"""Attacks the program for a while, and lets an independent judge say whether it kept its promises.

    tests/soak/adversary.py [--seconds 60] [--seed 1] [--episode 20] [--keep FOLDER]

One session after the other, each with random operators, watchers, attackers and faults of network, machine and terminal, from
seeds that count up from --seed: `--seed N --episode S --seconds S` repeats one, as far as the machine's timing repeats. Prints
a line for each and what was done in all. Recordings and logs of sessions with a violation are kept. Exit code 1: there was one.
Needs the PyPI package mcap (.deps/venv/bin/python has it)."""

import argparse
import shutil
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "python")]
from episode import World  # noqa: E402
from judge import judge  # noqa: E402
from recorded_session import RecordedSession  # noqa: E402
from session_log import SessionLog  # noqa: E402


def run_episode(folder, seed, seconds, counts):
    """(violations, words about the session)."""
    world = World(folder, seed)
    how = world.play(seconds)
    world.save(folder / "log.jsonl")
    session = RecordedSession.read(p for p in folder.glob("*.mcap") if "-fault-" not in p.name)
    log = SessionLog(world.entries)
    violations = judge(session, log)
    counts.update(world.counts)
    counts.update(sessions=1, commands=len(session.commands), states=len(session.states), stops=len(log.requests("stop")),
                  resets=len(log.requests("reset")), samples=len(log.of("sample")),
                  engagements=sum(c[2] == "engaged" for c in session.changes), unaligned=log.begin is None)
    counts["memory, MiB at most"] = max(counts["memory, MiB at most"], round(world.most_memory))
    return violations, f"{len(session.commands)} commands, {how}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=60.0, help="in all")
    parser.add_argument("--seed", type=int, default=1, help="of the first session")
    parser.add_argument("--episode", type=float, default=20.0, help="seconds of a session")
    parser.add_argument("--keep", type=Path, help="where to keep what was judged; default: a folder of this computer's, only with violations")
    options = parser.parse_args()
    end, seed = time.monotonic() + options.seconds, options.seed
    counts, total = Counter(), 0
    keep = options.keep or Path(tempfile.gettempdir()) / "steadyhand-adversary"
    while (left := end - time.monotonic()) > 0.5 or seed == options.seed:
        folder = Path(tempfile.mkdtemp(prefix="steadyhand-adversary-"))
        violations, words = run_episode(folder, seed, min(options.episode, max(left, 1.0)), counts)
        print(f"seed {seed}: {words}, {len(violations)} violations", flush=True)
        for rule, t, text in violations:
            print(f"  {t:8.3f} s  {rule}: {text}", flush=True)
        total += len(violations)
        if violations or options.keep:
            shutil.copytree(folder, keep / f"seed-{seed}", dirs_exist_ok=True)
            if violations:
                print(f"  kept: {keep / f'seed-{seed}'}")
        shutil.rmtree(folder)
        seed += 1
    for what, number in sorted(counts.items()):
        print(f"{what:24} {number}")
    print(f"{'violations':24} {total}")
    return 1 if total else 0


if __name__ == "__main__":
    sys.exit(main())
