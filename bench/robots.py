"""A table of the robots that are shipped, on the bundled hand: `PYTHONPATH=build/release/python .deps/venv/bin/python
bench/robots.py [ROBOT=SCALE ...]`.

Time is that of a plan at 20 Hz, over all three profiles; the error is that of `tracking`. Refused is the share of 20,000 random
configurations, of those in which no two meshes touch (bench/arm_meshes.py), that the arm's own bodies refuse, without those that
stand for what it holds; missed, how many of those in which meshes touch they call free.
"""

import csv
import json
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import steadyhand
import yaml
from arm_meshes import ArmMeshes, settings_of, urdf_of

PROGRAM = os.environ.get("STEADYHAND_PROGRAM", "build/release/steadyhand")
ROBOTS = {"ur5e": 0.5, "ur5e_fitted": 0.5, "ur3e": 0.3, "fr3": 0.4, "gen3": 0.5, "iiwa14": 0.5, "xarm7": 0.4, "so101": 0.3}
PROFILES = ("tracking", "anti-slosh", "waiter")
CONFIGURATIONS = 20_000


def refused(robot):
    """Shares of the configurations that are free, and of these that are refused; and how many are missed."""
    settings = settings_of(robot) | {"urdf": str(urdf_of(robot))}
    spheres = settings.pop("spheres", [])  # of a file that is extended, where there are bodies
    kind, bodies = ("bodies", settings["bodies"]) if "bodies" in settings else ("spheres", spheres)
    held = {body["name"] for body in bodies if body["name"].startswith(("glass_", "gripper_body", "gripper_fingers"))}
    settings[kind] = [body for body in bodies if body["name"] not in held]
    if isinstance(settings.get("pairs"), list):
        settings["pairs"] = [pair for pair in settings["pairs"] if not held & set(pair)]
    settings.pop("extends", None)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"{robot}.yaml"
        file.write_text(yaml.safe_dump(settings))
        arm = steadyhand.Robot(str(file))
    meshes = ArmMeshes(robot)
    low, high = np.maximum(arm.position_min, -np.pi), np.minimum(arm.position_max, np.pi)
    free = wrong = missed = 0
    for q in np.random.default_rng(1).uniform(low, high, (CONFIGURATIONS, len(low))):
        apart = arm.clearance(q) > 0
        if meshes.touches(q):
            missed += apart
        else:
            free += 1
            wrong += not apart
    return free / CONFIGURATIONS, wrong / free, missed


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
    _, share, missed = refused(robot)
    print(f"| `{robot}` | {len(described['joints'])} | {reach:.2f} | {bodies}, {pairs} | {1e2 * share:.1f} %, {missed} | {scale} | "
          f"{times[len(times) // 2]:.0f} | {times[int(0.99 * len(times))]:.0f} | {1e3 * error:.0f} | {failed} |", flush=True)  # fmt: skip


print("| robot | joints | reach, m | bodies, pairs | refused, missed | scale | plan, median, us | p99, us | tracking error, RMS, mm | not solved |")
print("|---|---|---|---|---|---|---|---|---|---|")
for name, metres in ROBOTS.items() if len(sys.argv) < 2 else [(a.split("=")[0], float(a.split("=")[1])) for a in sys.argv[1:]]:
    row(name, metres)
