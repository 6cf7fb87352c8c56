"""Runs that a script follows time step by time step."""

import copy
import json
import tempfile
from pathlib import Path

from ._sidewall import Run
from .recipe import Recipe


class Simulation:
    """for step in Simulation(recipe): one TimeStep before every time step, and one at the end, whose dt is 0.

    recipe: a Recipe, or what one is made of. output: the folder for what `sidewall run` writes; None: a temporary one.
    resume: go on from the folder's checkpoint. overwrite: replace whatever run stands in the folder's way.
    law: a function that takes the place of the models' speeds. Once a time step, and for every surface that is saved,
    it is given all points at once (see Points in the stubs) and returns an array of their speeds in the recipe's length
    per time, positive grows, negative etches. What is traced and what grows stays the recipe's matter.

    simulation.recipe is a copy of the recipe. Changed between two time steps, it holds from the current time step on:
    simulation.recipe["step[0].rate"] = 2 in the loop's body changes the time step at hand. What may change: [flux] but its
    method, [simplify], [advection], values of the step at hand, and all of later steps; else RecipeError.

    Ctrl-C stops it with a checkpoint, as does leaving a `with` block or close(). summary is what summary.json holds,
    None before the end. Simulations do not share anything but the processor.
    """

    def __init__(self, recipe, output=None, *, resume=False, overwrite=False, law=None):
        folder = tempfile.TemporaryDirectory(prefix="sidewall_") if output is None else None
        self.recipe = copy.copy(recipe) if isinstance(recipe, Recipe) else Recipe(recipe)
        self._given = self.recipe._read
        self.output = Path(folder.name if folder else output)
        self._run = Run(self.recipe._read, self.output, resume, overwrite, law, folder)

    def __iter__(self):
        return self

    def __next__(self):
        if self.recipe._read is not self._given:
            self._run.revise(self.recipe._read)
            self._given = self.recipe._read
        return self._run.next()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self._run.close()

    @property
    def summary(self):
        return json.loads(self._run.summary) if self._run.summary else None
