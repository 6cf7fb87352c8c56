"""Runs of a recipe, time step by time step."""

import copy
import json
import tempfile
from pathlib import Path

from ._sidewall import Run
from .recipe import Recipe


class Simulation:
    """A run to iterate over: `for step in Simulation(recipe)` gives a TimeStep before every time step and one with dt = 0 at the end.

    recipe: a Recipe, or a source of one. output: the folder that `sidewall run` would write; None: a temporary folder.
    resume: continue from the checkpoint in the folder. overwrite: replace a run that is in the folder.
    law: a function that replaces the speeds of the models. It is called once a time step and once for every surface
    that is saved, with all points at once (see Points in the stubs), and returns an array of their speeds in the recipe's
    length per time; positive grows, negative etches. The recipe still decides which species are traced and which film grows.

    simulation.recipe is a copy of the recipe. A change in the loop's body, such as simulation.recipe["step[0].rate"] = 2,
    holds from the current time step on. [flux] except its method, [simplify], [advection], values of the current step
    and everything of later steps may change; anything else raises RecipeError.

    Ctrl-C stops the run with a checkpoint, as does leaving a `with` block or close(). summary is the content of summary.json,
    None before the end. Two simulations in one process do not disturb each other.
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
