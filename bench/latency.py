#!/usr/bin/env python3
"""Hand to command on loopback: a client moves a hand over a real WebSocket at 90 Hz, the simulated arm follows.

    bench/latency.py [--seconds 30] [demo's other options]

The program counts the time from when the hand was where a sample says (of its own clock, docs/protocol.md) to the first joint command
that was made from it. Promised: a median of at most one planner period + 2 ms, a p99 of at most two periods. Exit code 1 if one is
broken."""

import argparse
import math
import re
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests/python"))
from live_client import Demo  # noqa: E402


def hand(t):
    return 0.1 * math.sin(math.pi * t), 0.1 * math.sin(2.0 * math.pi * t), 0.05 * math.sin(math.pi * t)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=30.0)
    options, rest = parser.parse_known_args()
    with tempfile.TemporaryDirectory() as folder:
        demo = Demo(folder, "--scale", 1, "--yaw", 0, *rest)
        client = demo.client()
        client.grip()
        for _ in range(round(options.seconds / 2.0)):
            client.move(hand, 2.0)  # begins where it ends
            if client.state["state"] != "engaged":  # this client was not let run for a while
                client.grip(take=False)
        text = demo.end()
    print(text, end="")
    period = 1000.0 / float(re.search(r"at ([0-9.]+) Hz", text).group(1))
    median, p99 = map(float, re.search(r"hand to command +median ([0-9.]+) +p99 ([0-9.]+)", text).groups())
    kept = True
    for name, value, most in (("median", median, period + 2.0), ("p99", p99, 2.0 * period)):
        kept = kept and value <= most
        print(f"{'kept  ' if value <= most else 'BROKEN'}             {name} {value} ms, at most {most} ms")
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
