"""Sloshing frequencies of containers of revolution: `python bench/containers.py`. For settings: the radius of the surface, and the
frequency of the first mode over that of a cylinder of this radius and fill (docs/reference/profiles.md).

Ideal liquid, small waves. With phi(r, z) cos(theta) the velocity potential, w^2 / g is the least value of

    (integral of |grad phi|^2 over the liquid) / (integral of phi^2 over the surface),

found among phi = sum c_ij r^(2 i + 1) z^j (Ritz). Tested on what is known: cylinders, and a hemisphere (w^2 R / g = 1.5602).
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

G = 9.81


@dataclass(frozen=True)
class Container:
    """By its inside: the radius at a height z above the bottom, both in m."""

    name: str
    profile: tuple[tuple[float, float], ...]  # z, radius: straight between them; a sphere's if there is one point, (0, radius)
    height: float  # m, of the rim, or of the shoulder that a wave must not reach
    fill: float  # m

    def radius(self, z):
        if len(self.profile) == 1:
            sphere = self.profile[0][1]
            return np.sqrt(np.maximum(0.0, z * (2 * sphere - z)))
        heights, radii = zip(*self.profile)
        return np.interp(z, heights, radii)


CONTAINERS = (
    Container("glass", ((0.0, 0.035), (0.1, 0.035)), 0.1, 0.09),
    Container("beaker", ((0.0, 0.035), (0.003, 0.04), (0.008, 0.043), (0.12, 0.043)), 0.12, 0.1),
    Container("bowl", ((0.0, 0.075),), 0.06, 0.045),
    Container("bottle", ((0.0, 0.024), (0.006, 0.031), (0.012, 0.0325), (0.13, 0.0325), (0.17, 0.012)), 0.13, 0.115),
)


def cylinder_frequency(radius, fill):
    """rad/s"""
    k = 1.8411837813 / radius
    return np.sqrt(G * k * np.tanh(k * fill))


def frequency(radius_at, fill, powers=6, points=60):
    """rad/s, of the first lateral mode. radius_at: of heights (k,) in m."""
    nodes, weights = np.polynomial.legendre.leggauss(points)
    x, w = (nodes + 1) / 2, weights / 2
    # Where the profile has a corner the quadrature is cut into pieces of equal height: a bend inside one costs little.
    pieces = 8
    z = np.concatenate([fill * (k + x) / pieces for k in range(pieces)])
    wz = np.tile(fill / pieces * w, pieces)
    R = radius_at(z)
    r = R[:, None] * x
    weight = wz[:, None] * R[:, None] * w * r  # dz dr r; the integral over theta is pi for all terms
    scale = float(radius_at(np.array([fill]))[0])
    rho, zeta = r / scale, np.broadcast_to((z / scale)[:, None], r.shape)
    terms = [(2 * i + 1, j) for i in range(powers) for j in range(powers)]
    by_r = [p * rho ** (p - 1) * zeta**j / scale for p, j in terms]
    by_z = [rho**p * (j * zeta ** max(j - 1, 0)) / scale for p, j in terms]
    around = [rho ** (p - 1) * zeta**j / scale for p, j in terms]
    stack = [np.array([(f * np.sqrt(weight)).ravel() for f in part]) for part in (by_r, by_z, around)]
    A = sum(part @ part.T for part in stack)
    rs = scale * x
    surface = np.array([(rs / scale) ** p * (fill / scale) ** j * np.sqrt(w * scale * rs) for p, j in terms])
    B = surface @ surface.T
    size = np.sqrt(np.diag(A))
    A, B = A / np.outer(size, size), B / np.outer(size, size)
    most = eigh(B, A + 1e-13 * np.eye(len(A)), eigvals_only=True)[-1]
    return float(np.sqrt(G / most))


def figures(container):
    """Radius of the surface (m), frequency (rad/s), and its ratio to a cylinder's."""
    radius = float(container.radius(np.array([container.fill]))[0])
    omega = frequency(container.radius, container.fill)
    return radius, omega, omega / cylinder_frequency(radius, container.fill)


def main():
    print("| container | rim, mm | fill, mm | radius of the surface, mm | frequency, Hz | over a cylinder's |\n|---|---|---|---|---|---|")
    for container in CONTAINERS:
        radius, omega, factor = figures(container)
        print(f"| {container.name} | {1e3 * container.height:.0f} | {1e3 * container.fill:.0f} | {1e3 * radius:.1f} | {omega / 2 / np.pi:.2f} | {factor:.3f} |")


if __name__ == "__main__":
    main()
