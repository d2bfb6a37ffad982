#!/usr/bin/env python3
"""Hand to command on loopback: a client moves a hand over a real WebSocket at 90 Hz, the simulated arm follows.

    bench/latency.py [--rates 50,100,250,500] [--seconds 30] [demo's other options]

The program counts the time from when the hand was where a sample says (of its own clock, docs/reference/protocol.md) to the first joint command
that was made from it. Promised: a median of at most one planner period + 2 ms, a p99 of at most two periods. Exit code 1 if one is
broken. Beside it stands what the way consists of: from the hand to the server, the wait for the planner and for the cycle where the
plan begins (the rest), and how late the computer woke the control thread, which no program can make up for."""

import argparse
import math
import re
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests/python"))
from live_client import Demo, run_soon  # noqa: E402
from mcap.reader import make_reader  # noqa: E402


def hand(t):
    return 0.1 * math.sin(math.pi * t), 0.1 * math.sin(2.0 * math.pi * t), 0.05 * math.sin(math.pi * t)


def percentiles(values):
    values = sorted(values)
    return values[len(values) // 2], values[min(len(values) - 1, int(0.99 * len(values)))]


def measure(rate, seconds, rest):
    """(median, p99) in ms of hand to command, hand to server, solve with check, and how late control woke; how many plans came late."""
    with tempfile.TemporaryDirectory() as folder:
        demo = Demo(folder, "--scale", 1, "--yaw", 0, "--rate", rate, *rest)
        run_soon(True)
        client = demo.client()
        client.grip()
        for _ in range(round(seconds / 2.0)):
            client.move(hand, 2.0)  # begins where it ends
            if client.state["state"] != "engaged":  # this client was not let run for a while
                client.grip(take=False)
        run_soon(False)
        text = demo.end()
        with open(next(Path(folder).glob("*.mcap")), "rb") as file:
            to_server = percentiles([(m.log_time - m.publish_time) / 1e6 for _, _, m in make_reader(file).iter_messages(["/operator_sample"])])
    find = lambda what: tuple(map(float, re.search(what + r".*?median ([0-9.]+) +p99 ([0-9.]+)", text).groups()))
    late = int(re.search(r"(\d+) came late", text).group(1))
    return find("hand to command"), to_server, find("planner"), find("woken late"), late


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rates", default="50,100,250,500")
    parser.add_argument("--seconds", type=float, default=30.0)
    options, rest = parser.parse_known_args()
    kept = True
    print("   Hz | hand to command, ms     at most | to the server | solve, check | control woken late | late plans")
    for rate in options.rates.split(","):
        command, server, solve, woken, late = measure(rate, options.seconds, rest)
        period = 1000.0 / float(rate)
        ok = command[0] <= period + 2.0 and command[1] <= 2.0 * period
        kept = kept and ok
        print(f"{rate:>5} | {command[0]:5.1f}  p99 {command[1]:5.1f}  {period + 2.0:5.1f}  p99 {2.0 * period:5.1f} | {server[0]:4.1f}  p99 {server[1]:4.1f}"
              f" | {solve[0]:3.1f}  p99 {solve[1]:3.1f} | {woken[0]:6.1f}  p99 {woken[1]:6.1f} | {late:4} {'kept' if ok else 'BROKEN'}", flush=True)
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
