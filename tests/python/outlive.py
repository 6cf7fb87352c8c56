"""Arrays that outlive what they are views of: run under valgrind by outlive_test.sh."""

import gc

import numpy as np

import sidewall

TRENCH = {
    "domain": {"extent": [1.0, 0.5], "grid_spacing": 0.25},
    "layer": [{"material": "Si", "shape": "trench", "width": 0.5, "depth": 0.5}],
    "step": [{"model": "single_particle", "duration": 0.1, "rate": 1.0, "sticking": 0.3, "deposit": "SiO2"}],
    "flux": {"rays": 1000},
    "simplify": {"method": "none"},
}

sidewall.limit_threads(1)
kept = []
simulation = sidewall.Simulation(TRENCH, law=lambda points: points.speeds)
for count, step in enumerate(simulation):
    mesh = step.surface()
    kept += [mesh.points, mesh.triangles, step.fluxes["neutral"], mesh.triangle_data["material"], step.profile()[0]]
    kept += [layer.points for _, layer in step.layers()]
    if count == 0:
        simulation.recipe["flux.rays"] = 1500
left = next(sidewall.Simulation(TRENCH)).surface().points  # of a run that is dropped at once
for method in ("monte-carlo", "radiosity"):
    flux = sidewall.flux(*mesh, rays=2000, boundary="reflective", method=method)
    kept += [flux.flux, flux.point_flux]
coarse = sidewall.simplify(*mesh, max_error=0.01)
kept += [left, coarse.points, sidewall.distance(*mesh, *coarse).forward]
before = [float(np.asarray(array, dtype=float).sum()) for array in kept]
del step, mesh, flux, coarse, simulation
gc.collect()
junk = [np.full(len(array), np.nan) for array in kept]  # overwrites what would have been freed
assert before == [float(np.asarray(array, dtype=float).sum()) for array in kept]
