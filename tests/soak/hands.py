"""Hands for the adversary: those of people, as npm super-hands brings them, and made-up ones. Each is a function of the time in
s that gives position (m) and quaternion x, y, z, w in robot axes."""

import bisect
import functools
import json
import math

from places import ROOT

RECORDINGS = ROOT / ".deps/node_modules/super-hands/examples"


def quaternion(rotation):
    """Of degrees in the Euler order YXZ, turned from WebXR's axes to the robot's."""
    (sx, cx), (sy, cy), (sz, cz) = ((math.sin(a), math.cos(a)) for a in (math.radians(rotation[k]) / 2 for k in "xyz"))
    w, x = cy * cx * cz + sy * sx * sz, cy * sx * cz + sy * cx * sz
    y, z = sy * cx * cz - cy * sx * sz, cy * cx * sz - sy * sx * cz
    return -z, -x, y, w


@functools.cache
def recorded():
    """(times, positions, quaternions) of every hand that there is."""
    hands = []
    for path in sorted(RECORDINGS.glob("*/*.json")):
        for track, content in sorted(json.loads(path.read_text()).items()):
            if track == "camera" or len(content["poses"]) < 100:
                continue
            poses = content["poses"]
            times = [1e-3 * p["timestamp"] for p in poses]
            hands.append(([t - times[0] for t in times],
                          [(-p["position"]["z"], -p["position"]["x"], p["position"]["y"]) for p in poses],
                          [quaternion(p["rotation"]) for p in poses]))
    return hands


def person(random):
    times, positions, turns = random.choice(recorded())
    start = random.uniform(0.0, times[-1])

    def hand(t):
        i = min(bisect.bisect(times, (start + t) % times[-1]), len(times) - 1)
        return positions[i], turns[i]

    return hand


def swing(random):
    """Slow to far too fast, small to far out of reach."""
    axes = [(random.uniform(0, 2), random.uniform(-1, 1), random.uniform(0, 6)) for _ in range(6)]
    size, turn, pace = random.choice((0.02, 0.1, 0.3, 1.0)), random.choice((0.0, 0.2, 1.0)), random.choice((0.3, 1.0, 3.0))

    def hand(t):
        values = [a * math.sin(6.28 * f * pace * t + phase) for f, a, phase in axes]
        angles = [turn * v for v in values[3:]]
        angle = math.sqrt(sum(a * a for a in angles)) + 1e-9
        s = math.sin(angle / 2) / angle
        return tuple(size * v for v in values[:3]), (s * angles[0], s * angles[1], s * angles[2], math.cos(angle / 2))

    return hand


def still(random):
    return lambda t: ((0.1, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))


def line(random):
    """Straight away from or towards the arm, and on."""
    way = [random.uniform(-1, 1) for _ in range(3)]
    speed = random.choice((0.2, 1.0, 2.5)) / math.sqrt(sum(w * w for w in way))
    return lambda t: (tuple(w * speed * min(t, 1.5) for w in way), (0.0, 0.0, 0.0, 1.0))


def leaping(random):
    """A hand whose tracking jumps now and then, for a frame or for good."""
    inner, leaps = swing(random), [(random.uniform(0, 6), random.choice((0.011, 9.0)), random.uniform(-0.7, 0.7)) for _ in range(3)]

    def hand(t):
        p, q = inner(t)
        for at, lasts, by in leaps:
            if at <= t < at + lasts:
                p = (p[0] + by, p[1], p[2] - by)
        return p, q

    return hand


KINDS = (person, person, person, swing, swing, still, line, leaping)
