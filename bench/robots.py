"""A table of the robots that are shipped, on the bundled hand: `STEADYHAND_PROGRAM=... python bench/robots.py [ROBOT=SCALE ...]`.

Time is that of a plan at 20 Hz, over all three profiles; the error is that of `tracking`.
"""

import csv
import json
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path

PROGRAM = os.environ.get("STEADYHAND_PROGRAM", "build/release/steadyhand")
ROBOTS = {"ur5e": 0.5, "ur5e_fitted": 0.5, "ur5e_ceiling": 0.5, "fr3": 0.4, "gen3": 0.5, "so101": 0.3}
PROFILES = ("tracking", "anti-slosh", "waiter")


def row(robot, scale):
    described = json.loads(subprocess.run([PROGRAM, "describe", robot], capture_output=True, text=True, check=True).stdout)
    offsets = [math.hypot(*(line[3] for line in joint["origin"][:3])) for joint in described["joints"][2:]]
    reach = sum(offsets) + math.hypot(*(line[3] for line in described["tool"]["origin"][:3]))
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([PROGRAM, "replay", "--robot", robot, "--scale", str(scale), "--out", folder], capture_output=True, check=True)
        steps = {name: list(csv.DictReader(open(Path(folder) / name / "plan.csv", newline=""))) for name in PROFILES}
    times = sorted(float(step["solve_time_us"]) for all_steps in steps.values() for step in all_steps)
    failed = sum(step["status"] != "solved" for all_steps in steps.values() for step in all_steps)
    errors = [sum((float(s[f"planned_{c}_m"]) - float(s[f"target_{c}_m"])) ** 2 for c in "xyz") for s in steps["tracking"]]
    error = math.sqrt(sum(errors) / len(errors))
    bodies, pairs = len(described["bodies"]), len(described["pairs"])
    print(f"| `{robot}` | {len(described['joints'])} | {reach:.2f} | {bodies}, {pairs} | {scale} | {times[len(times) // 2]:.0f} | "
          f"{times[int(0.99 * len(times))]:.0f} | {1e3 * error:.0f} | {failed} |")


print("| robot | joints | reach, m | bodies, pairs | scale | plan, median, us | p99, us | tracking error, RMS, mm | not solved |")
print("|---|---|---|---|---|---|---|---|---|")
for name, metres in ROBOTS.items() if len(sys.argv) < 2 else [(a.split("=")[0], float(a.split("=")[1])) for a in sys.argv[1:]]:
    row(name, metres)
