"""Flux on a surface that another library triangulated: a bowl in a flat wafer, from scattered points.

SciPy's Delaunay triangulation where it is installed, else a plain grid. Any library will do: sidewall.flux takes an array of points and
one of triangles, and sidewall.mend turns triangles over that do not face up. In a half sphere the flux is 1 / (1 + sticking) everywhere,
because every point of it sees half of the others and half of the opening.
"""

import numpy as np

import sidewall

RADIUS = 0.3


def bowl(x, y):
    """Height of the surface: flat at 0, with a half sphere in the middle."""
    r2 = (x**2 + y**2) / RADIUS**2
    return -RADIUS * np.sqrt(np.clip(1.0 - r2, 0.0, None))


def triangulated(n=64):
    """Points and triangles of a square of side 1, which must end on its sides."""
    line = np.linspace(-0.5, 0.5, n + 1)
    x, y = (a.ravel() for a in np.meshgrid(line, line, indexing="ij"))
    try:
        from scipy.spatial import Delaunay
    except ImportError:
        a = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
        triangles = np.concatenate([np.stack([a, a + n + 1, a + n + 2], 1), np.stack([a, a + n + 2, a + 1], 1)])
    else:
        inside = (abs(x) < 0.5) & (abs(y) < 0.5)
        shift = np.random.default_rng(1).uniform(-0.3 / n, 0.3 / n, (2, len(x))) * inside
        x, y = x + shift[0], y + shift[1]
        triangles = Delaunay(np.stack([x, y], 1)).simplices
    return np.stack([x, y, bowl(x, y)], axis=1), triangles


if __name__ == "__main__":
    mesh = sidewall.mend(*triangulated())
    centre = mesh.points[mesh.triangles].mean(axis=1)
    r = np.hypot(centre[:, 0], centre[:, 1])
    bottom, flat = r < 0.3 * RADIUS, r > 1.2 * RADIUS
    for sticking in (1.0, 0.1):
        flux = sidewall.flux(*mesh, sticking=sticking, rays=2e5)
        mean = [np.average(flux.flux[part], weights=flux.area[part]) for part in (flat, bottom)]
        print(f"sticking {sticking:3g}: flux {mean[0]:.3f} on the flat part; {mean[1]:.3f} at the bottom, exact {1 / (1 + sticking):.3f}")
