"""The liquid as the benches judge it: by an integration of its own, driven by the commands (docs/explanation/formulation.md, "The liquid")."""

import numpy as np
import steadyhand

G, SHARE, ZETA = 9.81, 0.837, 0.0055
GLASS = steadyhand.Glass()  # radius 35 mm, height 100 mm, filled to 90 mm
STEP = 1 / 500  # s


def frequency(glass=GLASS):
    """rad/s, of the first mode."""
    k = 1.8411837813 / glass.radius
    return glass.frequency_factor * np.sqrt(G * k * np.tanh(k * glass.fill))


def swing(force, state=None, omega=None, zeta=ZETA, glass=GLASS, step=STEP):
    """Height of the wave at the wall at each step (m), by x'' = w^2 (f - (f_z / g) x) - 2 zeta w x' along both axes.

    force: (m, 3), specific force in the glass's frame, m/s^2; state: what an earlier call returned, or at rest. Returns heights (m,)
    and the state at the end.
    """
    omega = frequency(glass) if omega is None else omega
    stiffness, damping = step * omega**2, step * 2 * zeta * omega
    x, y, u, v = (force[0][0], force[0][1], 0.0, 0.0) if state is None else state
    heights = []
    for f, g, h in force.tolist():  # numbers of Python's: arrays of two take ten times as long
        weight = h / G
        u += stiffness * (f - weight * x) - damping * u
        v += stiffness * (g - weight * y) - damping * v
        x += step * u
        y += step * v
        heights.append(((SHARE * x + (1 - SHARE) * f) ** 2 + (SHARE * y + (1 - SHARE) * g) ** 2) ** 0.5)
    return glass.radius / G * np.array(heights), (x, y, u, v)


def spilled_share(force, glass=GLASS, step=STEP):
    """Of the liquid, by the program's model."""
    liquid, state = steadyhand.Liquid(*glass), None
    for f in force:
        state = liquid.update(step, f)
    return state.spilled_share
