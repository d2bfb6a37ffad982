"""What each run of the closed loops found, by commit and processor, and a plot of it: a change that made the solver slower
is seen."""

import json
import os
import subprocess
import time
from pathlib import Path

import numpy as np

KEYS = ("sequence", "profile", "horizon")
WIDTH, HEIGHT, MARGIN = 900, 420, 60


def processor():
    """As the kernel calls it."""
    try:
        names = [l.split(":", 1)[1].strip() for l in Path("/proc/cpuinfo").read_text().splitlines() if "model name" in l]
    except OSError:
        names = []
    return names[0] if names else "unknown"


def commit(root):
    """Short hash, with + behind it where the tree differs from it; "unknown" outside of git."""
    try:
        run = subprocess.run(
            ["git", "-C", str(root), "describe", "--always", "--dirty=+", "--exclude=*"], capture_output=True, text=True
        )
    except OSError:
        return "unknown"
    return run.stdout.strip() if run.returncode == 0 else "unknown"


def append(path, root, loops):
    """One line for the run; `loops`: objects as bench_solvers prints them."""
    entry = {
        "time": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
        "commit": commit(root),
        "processor": processor(),
        "load": os.getloadavg()[0],
        "loops": loops,
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a") as file:
        file.write(json.dumps(entry) + "\n")


def load(path):
    """Runs, oldest first. A line that is none is an error that names it."""
    runs = []
    for number, line in enumerate(path.read_text().splitlines(), 1):
        try:
            run = json.loads(line)
            runs.append({key: run[key] for key in ("time", "commit", "processor", "loops")})
        except (json.JSONDecodeError, KeyError, TypeError):
            raise ValueError(f"{path}: line {number} is no run of the bench") from None
    return runs


def medians(runs):
    """{(sequence, profile, horizon): [median us of each run, or None]}"""
    series = {}
    for i, run in enumerate(runs):
        for loop in run["loops"]:
            series.setdefault(tuple(loop[key] for key in KEYS), [None] * len(runs))[i] = loop["p50_us"]
    return series


def svg(runs):
    """Medians over the runs, on a logarithmic axis, and each run's commit below it."""
    series = medians(runs)
    values = [v for line in series.values() for v in line if v]
    low, high = (np.floor(np.log2(min(values))), np.ceil(np.log2(max(values)))) if values else (0.0, 1.0)
    high = max(high, low + 1.0)
    x = lambda i: MARGIN + (WIDTH - 4 * MARGIN) * (i / max(1, len(runs) - 1))
    y = lambda v: HEIGHT - MARGIN - (HEIGHT - 2 * MARGIN) * (np.log2(v) - low) / (high - low)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" font-family="sans-serif" font-size="11">',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
        f'<text x="{MARGIN}" y="20" font-size="14">Median time of a solve, us, by run</text>',
    ]
    for power in np.arange(low, high + 1.0):
        at = y(2.0**power)
        parts.append(f'<line x1="{MARGIN}" x2="{WIDTH - 3 * MARGIN}" y1="{at:.1f}" y2="{at:.1f}" stroke="#ddd"/>')
        parts.append(f'<text x="{MARGIN - 8}" y="{at + 4:.1f}" text-anchor="end">{2.0**power:g}</text>')
    for i, run in enumerate(runs):
        parts.append(
            f'<text x="{x(i):.1f}" y="{HEIGHT - MARGIN + 16}" text-anchor="middle">{run["commit"]}'
            f'<title>{run["time"]}, {run["processor"]}</title></text>'
        )
    for index, (key, line) in enumerate(sorted(series.items())):
        colour = f"hsl({index * 360 // max(1, len(series))}, 65%, 42%)"
        points = [(x(i), y(v)) for i, v in enumerate(line) if v]
        name = f"{key[0]}, {key[1]}, {key[2]}"
        path = " ".join(f"{a:.1f},{b:.1f}" for a, b in points)
        parts.append(f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="1.5"><title>{name}</title></polyline>')
        parts += [f'<circle cx="{a:.1f}" cy="{b:.1f}" r="2.5" fill="{colour}"/>' for a, b in points]
        if len(series) <= 24:
            parts.append(f'<text x="{WIDTH - 3 * MARGIN + 8}" y="{MARGIN - 20 + 14 * index}" fill="{colour}">{name}</text>')
    return "\n".join([*parts, "</svg>"]) + "\n"
