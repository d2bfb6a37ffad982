"""How far off a guess of the hand is, by how far ahead it is made: `python bench/predictors.py [RECORDING ...]`.

Needs the Python package (build/release/python on PYTHONPATH). Without arguments: all hands of the npm package super-hands, both of
each recording. Every third sample is guessed from. Units are mm; the median and the mean of the hands' RMS errors.
"""

import sys
from pathlib import Path

import numpy as np
import steadyhand

AHEAD = (0.1, 0.2, 0.4)  # s
MODELS = ("constant_velocity", "decaying")
BUNDLED = Path(__file__).resolve().parents[1] / ".deps/node_modules/super-hands"


def hands(paths):
    """Times (s) and positions (m) of each hand that moves."""
    for path in paths:
        for track in ("",) if path.suffix == ".csv" else ("lhand", "rhand"):
            try:
                hand = steadyhand.read_recording(path, track=track)
            except steadyhand.SteadyhandError:
                continue  # has no such hand
            t, p = np.asarray(hand.t), np.asarray(hand.T_operator_hand)[:, :3, 3]
            fresh = np.concatenate([[True], np.diff(t) > 1e-4])
            t, p = t[fresh][:3000], p[fresh][:3000]
            if len(t) > 300 and p.std() > 0.01:
                yield f"{path.stem} {track}", t, p


def errors(t, p, model):
    """RMS, mm, by AHEAD."""
    predictor = steadyhand.Predictor(prediction=model)
    pose, squares = np.eye(4), []
    for i, now in enumerate(t):
        pose[:3, 3] = p[i]
        predictor.update(pose, now)
        if i >= 20 and i % 3 == 2 and now + AHEAD[-1] < t[-1]:
            truth = np.array([[np.interp(now + h, t, p[:, c]) for c in range(3)] for h in AHEAD])
            guess = np.array([predictor.at(now + h)[:3, 3] for h in AHEAD])
            squares.append(((guess - truth) ** 2).sum(1))
    return 1e3 * np.sqrt(np.mean(squares, axis=0))


def main():
    paths = [Path(name) for name in sys.argv[1:]] or sorted(BUNDLED.glob("machinima_tests/recordings/*.json")) + sorted(BUNDLED.glob("examples/*/demo-recording.json"))
    found = list(hands(paths))
    print(f"{len(found)} hands\n| model | " + " | ".join(f"{h} s" for h in AHEAD) + " |\n|---|" + "---|" * len(AHEAD))
    for model in MODELS:
        table = np.array([errors(t, p, model) for _, t, p in found])
        print(f"| `{model}` | " + " | ".join(f"{m:.1f} ({mean:.1f})" for m, mean in zip(np.median(table, 0), table.mean(0))) + " |")


if __name__ == "__main__":
    main()
