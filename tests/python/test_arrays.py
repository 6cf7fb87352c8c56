"""Functions on plain arrays, held against closed forms."""

import gc
import math

import numpy as np
import pytest

import sidewall


def grid(n, height=lambda x, y: 0 * x):
    """A square of side 1 as a mesh of 2 n^2 triangles, facing up."""
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij")
    points = np.stack([x, y, height(x, y)], axis=-1).reshape(-1, 3)
    a = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    b, c, d = a + n + 1, a + n + 2, a + 1
    return points, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def sphere(radius, spacing, half=1.5):
    n = round(2 * half / spacing) + 1
    axis = np.linspace(-half, half, n)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    return np.sqrt(x**2 + y**2 + z**2) - radius, (-half, -half, -half)


def test_a_sphere_comes_out_of_its_distance():
    phi, origin = sphere(1.0, 0.1)
    mesh = sidewall.extract(phi, 0.1, origin)
    radii = np.linalg.norm(mesh.points, axis=1)
    # Linear interpolation along an edge errs by at most h^2 / 8 times the second derivative, at most 1 / r.
    assert np.abs(radii - 1.0).max() < 0.1**2 / 8 * 1.1
    corners = mesh.points[mesh.triangles]
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    assert volume == pytest.approx(4 / 3 * math.pi, rel=0.01)  # positive: normals point out


def test_an_open_surface_ends_on_the_sides():
    z = np.arange(9) * 0.5
    phi = np.broadcast_to(z - 1.7, (5, 6, 9))
    mesh = sidewall.extract(phi, 0.5)
    assert np.allclose(mesh.points[:, 2], 1.7)
    assert (mesh.points.min(axis=0)[:2] == 0).all() and (mesh.points.max(axis=0)[:2] == [2.0, 2.5]).all()
    clipped = sidewall.extract(np.clip(phi, -1.5, 1.5), 0.5)
    assert (clipped.points == mesh.points).all()


@pytest.mark.parametrize(
    "phi, word",
    [
        (10 * sphere(1.0, 0.1)[0], "signed distance"),
        (np.full((3, 3, 3), np.nan), "finite"),
        (np.zeros((3, 3)), "three axes"),
        (np.broadcast_to(np.arange(9)[:, None, None] - 4.2, (9, 9, 9)), "ends along z"),
    ],
)
def test_what_is_no_distance_is_refused(phi, word):
    with pytest.raises(sidewall.GeometryError, match=word):
        sidewall.extract(phi, 0.1 if phi.shape[0] > 9 else 1.0)


def test_distance_between_planes():
    low, high = grid(4), grid(7, lambda x, y: 0 * x + 0.25)
    found = sidewall.distance(*low, *high)
    assert found.max == found.mean == 0.25
    assert found.forward.shape == (25,) and found.backward.shape == (64,)
    assert (found.forward == 0.25).all()


def test_simplify_keeps_the_bound_and_the_materials():
    points, triangles = grid(40, lambda x, y: 0.1 * np.sin(6 * x))
    material = (points[triangles][:, :, 1].mean(axis=1) > 0.5).astype(np.int64)
    mesh = sidewall.simplify(points, triangles, max_error=1e-3, material=material)
    assert len(mesh.points) < 0.6 * len(points)
    # Distances are measured at vertices, as the bound is stated; single precision of the search adds 1e-6.
    assert sidewall.distance(points, triangles, *mesh).max < 1e-3 + 1e-6
    assert set(mesh.triangle_data["material"]) == {0, 1}
    fewer = sidewall.simplify(*mesh, method="lindstrom-turk", target_vertices=100, weights=(1, 1, 0.1))
    assert len(fewer.points) <= 100


def test_flux_on_a_plane_is_one_and_shadowed_where_it_must():
    flat = sidewall.flux(*grid(3), rays=1e4)
    assert (flat.flux * flat.area).sum() == pytest.approx(1.0, abs=1e-6)  # every ray lands
    assert flat.absorbed == flat.rays and flat.leaked == 0

    # At distance x from an infinitely long step of height h the floor's flux is (1 + x / sqrt(x^2 + h^2)) / 2.
    xs, h = np.array([0.0, 0.5, 0.5 + 1e-6, 1.0]), 1.0
    points = np.array([(x, y, z) for x, z in zip(xs, (h, h, 0, 0)) for y in (0.0, 1.0)])
    triangles = np.concatenate([[(a, a + 2, a + 3), (a, a + 3, a + 1)] for a in (0, 2, 4)])
    step = sidewall.flux(points, triangles, rays=2e5, boundary=("reflective", "periodic"))
    # Mirrored at x = 0 and 1, this is a trench of width 1 and depth 1 with period 2: the floor's mean view factor of
    # its opening is sqrt(2) - 1, the source covers the period.
    floor = step.flux[4:]
    error = np.sqrt((step.flux_error[4:] ** 2).sum()) / 2
    assert floor.mean() == pytest.approx(math.sqrt(2) - 1, abs=4 * error + 1e-5)


def test_radiosity_solves_for_what_monte_carlo_counts():
    surface = grid(24, lambda x, y: -0.9 * np.exp(-(((x - 0.5) / 0.15) ** 4)))  # a trench
    # Where nothing sticks, a thermal gas has the same flux everywhere.
    still = sidewall.flux(*surface, sticking=0.0, method="radiosity", boundary="reflective")
    assert np.abs(still.flux - 1.0).max() < 1e-3 and still.absorbed == 0
    solved, counted = [
        sidewall.flux(*surface, sticking=0.1, relative_error=0.01, boundary="reflective", method=method)
        for method in ("radiosity", "monte-carlo")
    ]
    mean = [np.average(f.flux, weights=f.area) for f in (solved, counted)]
    # The errors of many triangles cancel in their mean.
    assert mean[0] == pytest.approx(mean[1], rel=0.01)
    error = np.hypot(solved.flux_error, counted.flux_error)
    assert np.average(np.abs(solved.flux - counted.flux) < 4 * error + 0.02) > 0.97
    assert solved.relative_error <= 0.01 and solved.leaked == 0 and solved.rays == solved.absorbed + solved.escaped
    chosen = sidewall.flux(*surface, sticking=0.1, relative_error=0.01, boundary="reflective", method="auto")
    assert chosen.relative_error <= 0.01 and chosen.rays < counted.rays  # radiosity, after rays of its choice
    error = np.hypot(chosen.flux_error, solved.flux_error)
    assert np.average(np.abs(chosen.flux - solved.flux) < 4 * error + 0.02) > 0.97
    with pytest.raises(sidewall.RecipeError, match="must be monte-carlo, radiosity or auto"):
        sidewall.flux(*surface, method="magic")


def test_flux_says_what_it_cannot_trace():
    points, triangles = grid(2)
    with pytest.raises(sidewall.RecipeError, match=r"sticking = 1.5: must be in \[0, 1\]"):
        sidewall.flux(points, triangles, sticking=1.5)
    with pytest.raises(sidewall.RecipeError, match="no triangle has material 7"):
        sidewall.flux(points, triangles, sticking={0: 0.1, 7: 0.2})
    with pytest.raises(sidewall.RecipeError, match="reflective, periodic or open"):
        sidewall.flux(points, triangles, boundary="closed")
    with pytest.raises(sidewall.RecipeError, match="rays = 0.5"):
        sidewall.flux(points, triangles, rays=0.5)
    turned = triangles[:, ::-1]
    with pytest.raises(sidewall.GeometryError):
        sidewall.flux(points, turned, boundary="reflective")
    mended = sidewall.mend(points, turned)
    assert sidewall.flux(*mended, rays=1e3).absorbed > 0
    with pytest.warns(UserWarning, match="taken as open"):
        sidewall.flux(points + 0.2 * points[:, 1:2] * [1, 0, 0], triangles, rays=1e3)  # a parallelogram


def test_bad_arrays_are_refused_by_name():
    points, triangles = grid(2)
    bad = points.copy()
    bad[3, 1] = np.inf
    for given, error, word in [
        ((points[:, :2], triangles), sidewall.GeometryError, r"points has the shape \(9, 2\)"),
        ((points, triangles.ravel()), sidewall.GeometryError, "triangles has the shape"),
        ((bad, triangles), sidewall.GeometryError, r"points\[3\]"),
        ((points, triangles + 1), sidewall.GeometryError, "there are 9 points"),
        ((points, triangles - 1), sidewall.GeometryError, "there are 9 points"),
        ((points, triangles.astype(float)), TypeError, "whole numbers"),
        ((points.astype(str), triangles), TypeError, "numbers"),
    ]:
        for function in (sidewall.simplify, sidewall.flux, sidewall.mend):
            with pytest.raises(error, match=word):
                function(*given)
    with pytest.raises(sidewall.GeometryError, match="one a triangle"):
        sidewall.flux(points, triangles, material=[1, 2])
    with pytest.raises(ValueError):  # the errors derive from Python's own, too
        sidewall.simplify(points, triangles, method="magic")


def test_arrays_are_views_and_outlive_their_mesh():
    mesh = sidewall.simplify(*grid(3), method="none")
    points = mesh.points
    assert not points.flags.owndata and not points.flags.writeable and points.base is mesh
    kept = points.copy()
    del mesh
    gc.collect()
    np.full(100_000, 7.0)  # what was freed would be written over
    assert (points == kept).all()


def test_lists_will_do():
    mesh = sidewall.mend([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    assert mesh.triangles.dtype == np.uint32 and repr(mesh) == "<sidewall.Mesh: 3 points, 1 triangles>"
