"""Rules for what the recording says by itself: limits and distances, of commands and of what the arm did."""

import numpy as np

from arm_model import smallest_body_gaps

# The judge's own tolerances, smaller than the program's: rounding of numbers, not of limits.
POSITION = 2e-6  # rad
COMMANDED = 1e-4  # share of speed and acceleration
# The measurement: encoder steps in positions; the servo may overshoot its commands slightly.
ENCODER = 1.3e-5  # rad
PLANNED = 0.01  # share of a profile's speeds: the solver's tolerance
CHANGED = 1.5  # s, after which the arm is as slow as a profile that was chosen asks for
MEASURED_SPEED = 0.01  # share
MEASURED_ACCELERATION = 0.05  # share
WINDOW = 10  # cycles: what encoder steps add to differences of positions becomes small
GAP = 0.005  # s, without a command: the servo was left to itself
SETTLED = 0.06  # s, after that: it follows commands again
BODIES = 2e-4  # m, that they may overlap
BETWEEN = 0.002  # s, between configurations that are looked at


def worst(rule, t, excess, words):
    """At most one violation: the worst of all where `excess` (N, joints) is above 0 or no number."""
    bad = ~(excess <= 0.0)
    if not bad.any():
        return []
    i, joint = np.unravel_index(np.argmax(np.where(np.isnan(excess), np.inf, excess)), excess.shape)
    return [(rule, float(t[i]), f"joint {joint}: {words} by {excess[i, joint]:.4g}; {int(bad.any(axis=1).sum())} times")]


def share(robot, key, part):
    return np.array(robot[key], dtype=float) * (1.0 + part)


def command_limits(session):
    """Positions, and speeds and accelerations as they are told and as they come of differences, also over gaps."""
    robot, c = session.robot, session.commands
    low, high = np.array(robot["position_min"]), np.array(robot["position_max"])
    speed_max, change_max = share(robot, "velocity_max", COMMANDED), share(robot, "acceleration_max", COMMANDED)
    yield from worst("command position", c.t, np.maximum(low - c.q, c.q - high) - POSITION, "beyond its limit")
    yield from worst("command speed", c.t, np.abs(c.dq) - speed_max, "beyond its limit")
    yield from worst("command acceleration", c.t, np.abs(c.ddq) - change_max, "beyond its limit")
    dt = np.diff(c.t)[:, None]
    speed = np.diff(c.q, axis=0) / dt
    follows = ~restarts(session)
    yield from worst("command speed", c.t[1:][follows], (np.abs(speed) - speed_max)[follows], "between commands beyond its limit")
    change = np.diff(c.dq, axis=0) / dt
    yield from worst("command acceleration", c.t[1:][follows], (np.abs(change) - change_max)[follows],
                     "between commands beyond its limit")
    both = follows[1:] & follows[:-1]
    bend = np.diff(speed, axis=0) / (0.5 * (dt[1:] + dt[:-1]))
    yield from worst("command acceleration", c.t[1:-1][both], (np.abs(bend) - change_max)[both],
                     "by differences of positions beyond its limit")


def command_steps(session):
    """A servo that gets no command continues for two cycles and then brakes at two thirds of its limit. After a gap the
    next command may be no further from where it was left than that leads, and a cycle."""
    c, change_max = session.commands, share(session.robot, "acceleration_max", COMMANDED)
    if len(c) < 3:
        return
    on = 3.0 * np.median(np.diff(c.t))
    speed = np.abs(c.dq[:-1]) + on * change_max
    brakes = 2.0 / 3.0 * change_max
    braking = np.clip(np.diff(c.t)[:, None] - on, 0.0, speed / brakes)
    step = np.abs(np.diff(c.q, axis=0)) - speed * (on + braking) + 0.5 * brakes * braking**2
    follows = ~restarts(session)
    yield from worst("command step", c.t[1:][follows], step[follows], "more at once than an arm goes on by itself")


def profile_limits(session, log):
    """The share of the speeds that a profile may use, while it is in force."""
    scales = next((e.get("velocity_scales", {}) for e in log.of("start")), {})
    changes = [(t, name) for i, (t, name) in enumerate(session.profiles) if i == 0 or session.profiles[i - 1][1] != name]
    c = session.commands
    for (begin, name), (end, _) in zip(changes, changes[1:] + [(np.inf, None)]):
        if name not in scales:
            continue
        judged = (c.t > begin + CHANGED) & (c.t < end)
        excess = np.abs(c.dq[judged]) - scales[name] * share(session.robot, "velocity_max", PLANNED)
        yield from worst("profile speed", c.t[judged], excess, f"beyond the share of {name}")


def measured_limits(session):
    robot, s = session.robot, session.states
    low, high = np.array(robot["position_min"]), np.array(robot["position_max"])
    speed_max, change_max = share(robot, "velocity_max", MEASURED_SPEED), share(robot, "acceleration_max", MEASURED_ACCELERATION)
    yield from worst("measured position", s.t, np.maximum(low - s.q, s.q - high) - ENCODER - POSITION, "beyond its limit")
    yield from worst("measured speed", s.t, np.abs(s.dq) - speed_max, "beyond its limit")
    if len(s) <= 2 * WINDOW:
        return
    dt = np.diff(s.t)[:, None]
    yield from worst("measured speed", s.t[1:], np.abs(np.diff(s.q, axis=0)) / dt - speed_max - ENCODER / dt,
                     "by differences of positions beyond its limit")
    led = led_throughout(session)
    change = np.abs(np.diff(s.dq, axis=0)) / dt - change_max
    yield from worst("measured acceleration", s.t[1:][led[1:]], change[led[1:]], "beyond its limit")
    span = s.t[WINDOW:] - s.t[:-WINDOW]
    speed = (s.q[WINDOW:] - s.q[:-WINDOW]) / span[:, None]
    between = 0.5 * (span[WINDOW:] + span[:-WINDOW])[:, None]
    bend = np.abs(speed[WINDOW:] - speed[:-WINDOW]) / between - change_max - 4.0 * ENCODER / between**2
    calm = led[WINDOW:-WINDOW] & led[2 * WINDOW:]
    yield from worst("measured acceleration", s.t[WINDOW:-WINDOW][calm], bend[calm], "by differences of positions beyond its limit")


def led_throughout(session):
    """For each state: commands came all the time just before, so that the arm did as it was told."""
    c, s = session.commands.t, session.states.t
    led = (s >= c[0] + SETTLED) & (s <= c[-1])
    for i in np.flatnonzero(np.diff(c) > GAP):
        led &= (s < c[i] + BETWEEN) | (s > c[i + 1] + SETTLED)
    return led


def restarts(session):
    """For each command but the first: whether the arm was taken over anew since the one before, where it then stood."""
    c = session.commands.t
    anew = [t for t, _, to, _ in session.changes if to in ("idle", "fault")]
    anew += [a for a, _ in session.spans] if len(session.spans) > 1 else []
    return np.diff(np.searchsorted(np.sort(anew), c, side="right")) > 0


def looked_at(track):
    """Configurations at least every BETWEEN s: those of the track, and straight lines over its gaps."""
    t, q = [track.t], [track.q]
    for i in np.flatnonzero(np.diff(track.t) > 1.5 * BETWEEN):
        if track.t[i + 1] - track.t[i] > 1.0:
            continue  # it was not recorded meanwhile
        parts = np.linspace(0.0, 1.0, int((track.t[i + 1] - track.t[i]) / BETWEEN) + 1)[1:-1, None]
        t.append(track.t[i] + parts[:, 0] * (track.t[i + 1] - track.t[i]))
        q.append(track.q[i] + parts * (track.q[i + 1] - track.q[i]))
    t, q = np.concatenate(t), np.concatenate(q)
    order = np.argsort(t)
    return t[order], q[order]


def distances(session):
    robot = session.robot
    for name, track in (("command", session.commands), ("measured", session.states)):
        if not len(track):
            continue
        t, q = looked_at(track)
        finite = np.isfinite(q).all(axis=1)
        t, q = t[finite], q[finite]
        if robot["pairs"]:
            gap, pair = smallest_body_gaps(robot, q)
            i = gap.argmin()
            if gap[i] < -BODIES:
                a, b = (robot["bodies"][k]["name"] for k in robot["pairs"][pair[i]])
                yield (f"{name} bodies", float(t[i]), f"{a} and {b} overlap by {-1e3 * gap[i]:.3f} mm; {int((gap < -BODIES).sum())} times")


RULES = (command_limits, command_steps, measured_limits, distances)
