"""Weights for what people want: tracking error against wave height, and the front of what is best: `python bench/pareto.py`.

Needs the Python package (build/release/python on PYTHONPATH) and matplotlib. Draws weights at random around those of a profile, for three
kinds of them: `follow` (the liquid does not count), `waiter` (it is spared by weights) and `carry` (it is a part of the plan, and the
hand's tilt is left out). Each is tried on the training hands of hands.py; --picture draws all of them, the fronts, and the profiles of
this project, also on the hands that judge. --best prints the weights along a front.
"""

import argparse
import json
import multiprocessing
import tempfile
from pathlib import Path

import numpy as np
from carrying import measure, variant
from hands import add_arguments, find_hands
from liquid import ZETA

# By kind: the least and the largest of each weight; what is drawn lies between them, even in the logarithm. 0 stays.
RANGES = {
    "follow": {"orientation": (0.5, 8), "velocity": (1e-3, 0.1), "acceleration": (3e-4, 0.01), "acceleration_step": (1e-4, 0.02)},
    "waiter": {"orientation": (0.5, 8), "velocity": (3e-3, 0.1), "acceleration": (1e-3, 0.02), "acceleration_step": (1e-4, 0.02), "lateral": (0.1, 20), "vertical": (0.02, 10)},
    "carry": {"position": (500, 2000), "orientation": (0.3, 5), "velocity": (0.01, 0.3), "acceleration": (1e-3, 0.02), "acceleration_step": (2e-4, 0.01), "lateral": (0.1, 5), "vertical": (0.01, 0.5)},
}  # fmt: skip
CHANGES = {"waiter": {"prediction": "decaying"}}
HIGHEST = 60.0  # mm, of waves: what is above counts as this


def figures(rows):
    return {
        "rms_mm": float(np.mean([row["rms_mm"] for row in rows])),
        "wave_mm": float(np.mean([min(row["wave_mm"], HIGHEST) for row in rows])),
        "off_mm": float(np.mean([min(row["off_mm"], HIGHEST) for row in rows])),
        "largest_off_mm": float(min(max(row["off_mm"] for row in rows), HIGHEST)),
        "largest_rms_mm": float(max(row["rms_mm"] for row in rows)),
        "largest_wave_mm": float(min(max(row["wave_mm"] for row in rows), HIGHEST)),
        "step": float(np.mean([row["step_99"] for row in rows])),
    }


def front(points):
    """Indices of those that none beats in both, by error."""
    order, best, result = np.argsort([p["rms_mm"] for p in points]), np.inf, []
    for i in order:
        if points[i]["wave_mm"] < best:
            best = points[i]["wave_mm"]
            result.append(int(i))
    return result


def search(kind, hands, count, rate, seed, pool):
    random, points = np.random.default_rng(seed), []
    with tempfile.TemporaryDirectory() as folder:
        for i in range(count):
            weights = {name: float(np.exp(random.uniform(*np.log(bounds)))) for name, bounds in RANGES[kind].items()}
            path = variant(folder, f"{kind}-{i}", kind, weights=weights, **CHANGES.get(kind, {}))
            rows = pool.map(measure, [(hand, path, rate, "ur5e", (1.0, ZETA), False) for hand in hands], chunksize=1)
            points.append({"kind": kind, "weights": weights, **figures(rows)})
    return points


def draw(points, shipped, path):
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(8, 5), layout="constrained")
    for color, (kind, label) in zip(("#2f7fd0", "#e0a100", "#16a085"), {"follow": "the liquid does not count", "waiter": "weights spare it", "carry": "it is a part of the plan, upright"}.items()):
        mine = [p for p in points if p["kind"] == kind]
        if not mine:
            continue
        best = [mine[i] for i in front(mine)]
        axes.plot([p["rms_mm"] for p in mine], [p["wave_mm"] for p in mine], ".", color=color, alpha=0.35, ms=4)
        axes.plot([p["rms_mm"] for p in best], [p["wave_mm"] for p in best], "-", color=color, lw=1.5, label=label)
    for name, (training, judged) in shipped.items():
        axes.plot(training["rms_mm"], training["wave_mm"], "ko", ms=5)
        axes.plot([training["rms_mm"], judged["rms_mm"]], [training["wave_mm"], judged["wave_mm"]], "k-", lw=0.7)
        axes.plot(judged["rms_mm"], judged["wave_mm"], "kx", ms=6)
        axes.annotate(name, (training["rms_mm"], training["wave_mm"]), textcoords="offset points", xytext=(6, 5))
    axes.plot([], [], "ko", ms=5, label="profiles, on the training hands")
    axes.plot([], [], "kx", ms=6, label="and on those that judge")
    axes.axhline(10, color="#c62828", lw=0.8, ls="--", label="the rim")
    axes.set(xscale="log", yscale="log", xlabel="position error, RMS, mean of hands, mm", ylabel=f"highest wave, mean of hands, mm (at most {HIGHEST:g})")
    axes.set_xticks([5, 10, 20, 50, 100, 200], ["5", "10", "20", "50", "100", "200"], minor=False)
    axes.set_yticks([2, 5, 10, 20, 50], ["2", "5", "10", "20", "50"], minor=False)
    axes.minorticks_off()
    axes.grid(alpha=0.25)
    axes.legend(loc="best", fontsize=9)
    figure.savefig(path, dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split(":")[0])
    add_arguments(parser)
    parser.add_argument("--kind", nargs="*", choices=list(RANGES), default=list(RANGES))
    parser.add_argument("--count", type=int, default=120, help="weights tried of each kind")
    parser.add_argument("--rate", type=float, default=20.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--points", type=Path, default=Path("build/bench/pareto.json"), help="where what was found is kept; more is added")
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--best", action="store_true")
    arguments = parser.parse_args()
    points = json.loads(arguments.points.read_text()) if arguments.points.exists() else []
    every = find_hands(arguments.recordings, arguments.train, arguments.seconds)
    parts = [[hand for hand in every if hand.training is training] for training in (True, False)]
    with multiprocessing.Pool() as pool:
        for kind in arguments.kind if arguments.count else []:
            points += search(kind, parts[0], arguments.count, arguments.rate, arguments.seed, pool)
            arguments.points.parent.mkdir(parents=True, exist_ok=True)
            arguments.points.write_text(json.dumps(points, indent=0))
        if arguments.picture:
            on = lambda name, hands: figures(pool.map(measure, [(hand, name, arguments.rate, "ur5e", (1.0, ZETA), False) for hand in hands], chunksize=1))
            shipped = {name: [on(name, part) for part in parts] for name in ("tracking", "follow", "anti-slosh", "waiter", "carry")}
            draw(points, shipped, arguments.picture)
    if arguments.best:
        for kind in arguments.kind:
            mine = [p for p in points if p["kind"] == kind]
            for i in front(mine):
                numbers = ", ".join(f"{name} {value:.3g}" for name, value in mine[i]["weights"].items())
                print(f"{kind:8s} " + " ".join(f"{key} {mine[i][key]:.3g}" for key in ("rms_mm", "largest_rms_mm", "wave_mm", "largest_wave_mm", "off_mm", "largest_off_mm", "step")) + f"   {numbers}")


if __name__ == "__main__":
    main()
