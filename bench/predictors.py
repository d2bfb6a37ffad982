"""How far off a guess of the hand is, by how far ahead it is made, and whether it knows how far: `python bench/predictors.py`.

Needs the Python package (build/release/python on PYTHONPATH). On the hands that nothing was tuned on (hands.py), at the scale of the tool.
Every third sample is guessed from. Two tables: the RMS error in mm, median of the hands and mean; and for the models that tell standard
deviations the share of errors that lie inside one and two of them, along the hand's way and in each direction across it (of a normal
distribution 68.3 % and 95.4 %), the mean of hands.
"""

import argparse

import numpy as np
import steadyhand
from hands import add_arguments, hands_of

AHEAD = (0.1, 0.2, 0.3, 0.4)  # s
MODELS = ("constant_velocity", "decaying")


def guess(hand, model):
    """Errors (k, AHEAD, 3): along the way and in two directions across it, m; and the standard deviations (k, AHEAD, 2)."""
    recorded = hand.read()
    t, p = np.asarray(recorded.t), hand.scale * np.asarray(recorded.T_operator_hand)[:, :3, 3]
    fresh = np.concatenate([[True], np.diff(t) > 1e-4])
    t, p = t[fresh], p[fresh]
    predictor, pose, errors, spreads = steadyhand.Predictor(prediction=model), np.eye(4), [], []
    for i, now in enumerate(t):
        pose[:3, 3] = p[i]
        predictor.update(pose, now)
        if i < 20 or i % 3 != 2 or now + AHEAD[-1] >= t[-1]:
            continue
        along = predictor.velocity / max(np.linalg.norm(predictor.velocity), 1e-12)
        across = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
        across /= max(np.linalg.norm(across), 1e-12)
        axes = np.array([along, across, np.cross(along, across)])
        truth = np.array([[np.interp(now + h, t, p[:, c]) for c in range(3)] for h in AHEAD])
        errors.append((np.array([predictor.at(now + h)[:3, 3] for h in AHEAD]) - truth) @ axes.T)
        spreads.append([predictor.spread(now + h) for h in AHEAD])
    return np.array(errors), np.array(spreads)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split(":")[0])
    add_arguments(parser)
    found = hands_of(parser.parse_args())
    guesses = {model: [guess(hand, model) for hand in found] for model in MODELS}
    heads = " | ".join(f"{h} s" for h in AHEAD)
    print(f"{len(found)} hands\n| model | {heads} |\n|---|" + "---|" * len(AHEAD))
    for model in MODELS:
        rms = 1e3 * np.array([np.sqrt((errors**2).sum(2).mean(0)) for errors, _ in guesses[model]])
        print(f"| `{model}` | " + " | ".join(f"{median:.1f} ({mean:.1f})" for median, mean in zip(np.median(rms, 0), rms.mean(0))) + " |")
    print(f"\n| inside | {heads} |\n|---|" + "---|" * len(AHEAD))
    for model in MODELS:
        if not np.any(guesses[model][0][1]):
            continue
        for name, columns, spread in (("along", [0], 0), ("across", [1, 2], 1)):
            for sigmas in (1, 2):
                inside = [np.mean(np.abs(errors[:, :, columns]) < sigmas * spreads[:, :, spread, None], axis=(0, 2)) for errors, spreads in guesses[model]]
                print(f"| {name}, {sigmas} | " + " | ".join(f"{100 * share:.0f} %" for share in np.mean(inside, 0)) + " |")


if __name__ == "__main__":
    main()
