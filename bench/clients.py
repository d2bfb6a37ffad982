#!/usr/bin/env python3
"""Many clients at once: one leads the arm, the others send hands just as often and have no lease.

    bench/clients.py [--clients 64] [--hertz 90] [--seconds 20] [demo's other options]

Prints, for one client and then for all, what the session came to. Exit code 1 if the program ends badly, a command is beyond a limit or
in contact, a hand without the lease is heard, the arm stops following, or the control loop misses 0.1 % more deadlines than with one client."""

import argparse
import math
import re
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests/python"))
from live_client import Client, Demo, run_soon  # noqa: E402


def hand(t):
    return 0.1 * math.sin(math.pi * t), 0.1 * math.sin(2.0 * math.pi * t), 0.05 * math.sin(math.pi * t)


def frame(text):
    """A short text message, masked with zeros: what costs time here is the server."""
    payload = text.encode()
    head = bytes([0x81, 0x80 | len(payload)]) if len(payload) < 126 else bytes([0x81, 0xFE]) + len(payload).to_bytes(2, "big")
    return head + bytes(4) + payload


class Watcher:
    """Sends without the lease and takes what comes without looking at it."""

    def __init__(self, port):
        self.socket = Client(port).socket
        self.socket.setblocking(False)
        self.bytes = 0

    def send(self, sequence, now):
        text = (f'{{"type":"sample","sequence":{sequence},"t_s":{now:.6f},"p":[0.5,0.5,0.5],"q":[0,0,0,1],'
                '"clutch":true,"tracked":true,"emulated":false}')
        self.socket.sendall(frame(text))

    def drain(self):
        while True:
            try:
                more = len(self.socket.recv(1 << 18))
            except BlockingIOError:
                return
            if more == 0:
                raise ConnectionError("the server closed a watcher")
            self.bytes += more


def run(clients, hertz, seconds, rest):
    with tempfile.TemporaryDirectory() as folder:
        demo = Demo(folder, "--scale", 1, "--yaw", 0, *rest)
        run_soon(True)
        leader = demo.client()
        leader.grip()
        watchers = [Watcher(demo.port) for _ in range(clients - 1)]
        begin, tick, lost = time.monotonic(), 0, 0
        while (now := time.monotonic()) < begin + seconds:
            leader.sample(hand(now - begin), True)
            tick += 1
            for watcher in watchers:
                watcher.send(tick, now)
            for watcher in watchers:
                watcher.drain()
            for message in leader.messages():
                lost += message["type"] == "state" and message["state"] != "engaged"
            leader.ping()
            time.sleep(max(0.0, begin + tick / hertz - time.monotonic()))
        elapsed = time.monotonic() - begin
        watched = sum(w.bytes for w in watchers)
        run_soon(False)
        text = demo.end()
    return text, leader.sequence, tick / elapsed, watched / elapsed / 1e6, lost


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--clients", type=int, default=64)
    parser.add_argument("--hertz", type=float, default=90.0)
    parser.add_argument("--seconds", type=float, default=20.0)
    options, rest = parser.parse_known_args()
    missed, kept = [], True
    for clients in (1, options.clients):
        text, sent, rate, megabytes, lost = run(clients, options.hertz, options.seconds, rest)
        heard = int(re.search(r"hand +(\d+) samples", text).group(1))
        # Until a client takes control, a recorded hand moves the arm; its samples count here too.
        missed.append(float(re.search(r"missed \(([0-9.]+) %\)", text).group(1)))
        print(f"--- {clients} clients, {rate:.0f} messages a second of each; {megabytes:.1f} MB/s to the watchers; the arm did not follow in "
              f"{lost} states\n{text[text.index('session  '):]}", flush=True)
        kept = kept and " 0 beyond a limit, 0 in contact" in text and lost == 0
        kept = kept and heard <= sent + 400
    kept = kept and missed[1] <= missed[0] + 0.1
    print(f"{'kept' if kept else 'BROKEN'}: deadlines missed {missed[1]} % with {options.clients} clients, {missed[0]} % with one")
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
