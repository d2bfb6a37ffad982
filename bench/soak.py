#!/usr/bin/env python3
"""Runs `steadyhand demo --headless` for long and judges what it came to.

    bench/soak.py [--seconds 1800] [demo's other options]

Needs the PyPI package mcap (.deps/venv/bin/python has it). Prints the program's summary, its memory over time, and what of the promises it kept. Exit code 1 if one is broken. Deadlines are
judged only where real-time priority was granted, and beside those of a bare loop that wakes as often on every processor, with a higher priority, and does nothing: what that misses, the machine misses."""

import argparse
import multiprocessing
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(os.environ.get("STEADYHAND_ROOT", Path(__file__).resolve().parents[1]))
PROGRAM = os.environ.get("STEADYHAND_PROGRAM", str(ROOT / "build/release/steadyhand"))


PERIOD = 0.002  # s, of the simulated arm
BARE_PRIORITY = 90  # above control's 80


def bare_loop(processor, stop, results):
    """Wakes every PERIOD on this processor, and counts the periods that it slept through: (missed, all)."""
    os.sched_setaffinity(0, {processor})
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(BARE_PRIORITY))
    missed, count, due = 0, 0, time.monotonic() + PERIOD
    while not stop.is_set():
        time.sleep(max(0.0, due - time.monotonic()))
        late = int((time.monotonic() - due) / PERIOD)
        missed, count, due = missed + late, count + 1 + late, due + (1 + late) * PERIOD
    results.put((missed, count))


class BareLoops:
    """One on each processor, where real-time priority is granted."""

    def __init__(self):
        self.stop, self.results = multiprocessing.Event(), multiprocessing.SimpleQueue()
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        except PermissionError:
            self.processes = []
            return
        self.processes = [multiprocessing.Process(target=bare_loop, args=(processor, self.stop, self.results)) for processor in os.sched_getaffinity(0)]
        for process in self.processes:
            process.start()

    def end(self):
        """%, of their periods missed."""
        self.stop.set()
        counts = [self.results.get() for _ in self.processes]
        return 100.0 * sum(missed for missed, _ in counts) / max(1, sum(count for _, count in counts))


def resident_kib(pid):
    try:
        return int(re.search(r"VmRSS:\s+(\d+)", Path(f"/proc/{pid}/status").read_text()).group(1))
    except (OSError, AttributeError):
        return None


def watch(command):
    """Runs the command; its output, exit code and memory in KiB, once a second."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    memory = []
    while process.poll() is None:
        memory.append(resident_kib(process.pid))
        time.sleep(1.0)
    return process.stdout.read(), process.returncode, [m for m in memory if m]


def recorded_states(text):
    """How many measured states the public MCAP reader's index counts in the session's file."""
    from mcap.reader import make_reader

    with open(re.search(r"^recorded: (.+)$", text, re.MULTILINE).group(1), "rb") as file:
        summary = make_reader(file).get_summary()
    (channel,) = (c.id for c in summary.channels.values() if c.topic == "/joint_state")
    return summary.statistics.channel_message_counts[channel]


def promises(text, memory, bare, seconds):
    def number(pattern):
        return float(re.search(pattern, text).group(1))

    yield "no command beyond a limit", number(r"looked at, (\d+) beyond") == 0
    yield "no spheres in contact", number(r"(\d+) in contact") == 0
    yield "recording complete", "were dropped" not in text and recorded_states(text) == number(r"control +(\d+) cycles")
    # The first tenth is warming up.
    settled = memory[len(memory) // 10:]
    # The recording's index stays in memory until its end: 0.4 kB a second.
    yield "memory grows by less than 1 MiB and half a KiB a second", not settled or settled[-1] - settled[0] < 1024 + 0.5 * seconds
    period = 1000.0 / number(r"at ([0-9.]+) Hz")
    yield "latency: median at most a planner period + 2 ms", number(r"hand to command\s+median ([0-9.]+)") <= period + 2.0
    yield "latency: p99 at most two planner periods", number(r"hand to command.*p99 ([0-9.]+)") <= 2.0 * period
    if "no real-time priority" not in text:
        yield "at most 0.1 % of control deadlines missed beyond those of a bare loop", number(r"missed \(([0-9.]+) %\)") <= 0.1 + bare


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=1800.0)
    options, rest = parser.parse_known_args()
    with tempfile.TemporaryDirectory() as folder:
        loops = BareLoops()
        text, code, memory = watch([PROGRAM, "demo", "--headless", "--keep-going", "--seconds", str(options.seconds), "--sessions", folder, *rest])
        bare = loops.end()
        print(text, end="")
        if code != 0:
            return code
        kept = judge(text, memory, bare, options.seconds)
    return 0 if kept else 1


def judge(text, memory, bare, seconds):
    print(f"this machine       a bare loop missed {bare:.4f} % of its deadlines")
    print(f"memory             {memory[0] / 1024:.1f} MiB at first, {memory[-1] / 1024:.1f} MiB at last, {max(memory) / 1024:.1f} MiB at most")
    kept = True
    for name, holds in promises(text, memory, bare, seconds):
        print(f"{'kept  ' if holds else 'BROKEN'}             {name}")
        kept = kept and holds
    return kept


if __name__ == "__main__":
    sys.exit(main())
