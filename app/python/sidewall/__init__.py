"""Etch and deposition on a virtual wafer: Sidewall's recipes, runs and mesh functions for Python."""

from ._sidewall import (
    Distance,
    Error,
    FileError,
    Flux,
    GeometryError,
    IoError,
    Mesh,
    NumericsError,
    RecipeError,
    TimeStep,
    __version__,
    distance,
    extract,
    flux,
    limit_threads,
    mend,
    simplify,
    thread_count,
)
from .recipe import Recipe
from .simulation import Simulation

__all__ = [
    "Distance", "Error", "FileError", "Flux", "GeometryError", "IoError", "Mesh", "NumericsError", "Recipe",
    "RecipeError", "Simulation", "TimeStep", "distance", "extract", "flux", "limit_threads", "mend", "simplify",
    "thread_count",
]
