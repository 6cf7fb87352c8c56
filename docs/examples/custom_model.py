"""A rate law written in Python: an ion-assisted etch that saturates when neutrals are scarce.

V = -k J N / (J + N), J the ions' flux and N the neutrals', in units in which an open wafer etches at k / 2. The recipe says what
is traced and which materials there are; the law takes the place of the model's own speeds.
"""

import numpy as np

import sidewall

RECIPE = {
    "domain": {"extent": [2.0, 0.4], "grid_spacing": 0.1, "boundary": ["reflective", "periodic"]},
    "layer": [
        {"material": "Si"},
        {"material": "Mask", "shape": "trench", "thickness": 0.3, "width": 1.0},
    ],
    "step": [
        {
            "model": "multi_particle",
            "duration": 1.0,
            # The rates bound the time step; the law below replaces them.
            "species": [
                {"name": "neutral", "sticking": 0.3, "rate": {"Si": -1.0}},
                {"name": "ion", "kind": "ion", "rate": {"Si": -1.0}},
            ],
        }
    ],
    "flux": {"rays": 20_000},
}


def law(points, k=1.0):
    """Speeds of all points, in um/s; negative etches."""
    ions, neutrals = points.fluxes["ion"], points.fluxes["neutral"]
    both = ions + neutrals
    speed = np.divide(-k * ions * neutrals, both, out=np.zeros_like(both), where=both > 0)
    return np.where(points.material == points.materials["Si"], speed, 0.0)


if __name__ == "__main__":
    for step in sidewall.Simulation(RECIPE, law=law):
        print(f"{step.time:.3f} s  depth {step.measures['depth']:.3f} um")
    print(f"mean rate at the floor {step.measures['depth'] / step.time:.3f} um/s, 0.5 on an open wafer")
