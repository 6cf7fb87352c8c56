from os import PathLike
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, Mapping, Optional, Protocol, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

class Error(Exception): ...
class RecipeError(Error, ValueError): ...
class FileError(Error, OSError): ...
class GeometryError(Error, ValueError): ...
class NumericsError(Error, ArithmeticError): ...
class IoError(Error, OSError): ...

# Attributes of results are read-only.
class Mesh:
    points: Floats  # (n, 3)
    triangles: NDArray[np.uint32]  # (m, 3)
    point_data: Dict[str, Union[Floats, Ints]]
    triangle_data: Dict[str, Union[Floats, Ints]]
    def __iter__(self) -> Iterator[Any]: ...  # points, triangles

class Flux:
    flux: Floats  # by triangle
    flux_error: Floats
    point_flux: Floats
    point_flux_error: Floats
    area: Floats
    relative_error: float
    rays: int
    absorbed: int
    escaped: int
    leaked: int
    segments: int
    seconds: float

class Distance:
    max: float
    mean: float
    forward: Floats
    backward: Floats

def simplify(
    points: ArrayLike,
    triangles: ArrayLike,
    *,
    method: str = "region-bounded",
    l0: Optional[float] = None,
    step: Optional[float] = None,
    l_max: Optional[float] = None,
    target_vertices: Optional[int] = None,
    weights: Optional[Tuple[float, float, float]] = None,
    max_error: Optional[float] = None,
    feature_parameter: Union[float, str] = 0.5,
    grid_spacing: Optional[float] = None,
    material: Optional[ArrayLike] = None,
) -> Mesh: ...
def flux(
    points: ArrayLike,
    triangles: ArrayLike,
    *,
    sticking: Union[float, Mapping[int, float]] = 1.0,
    material: Optional[ArrayLike] = None,
    source_exponent: float = 1.0,
    rays: Optional[float] = None,
    relative_error: Optional[float] = None,
    boundary: Union[None, str, Tuple[str, str]] = None,
    seed: int = 1,
    method: str = "auto",
) -> Flux: ...
def mend(points: ArrayLike, triangles: ArrayLike) -> Mesh: ...
def extract(phi: ArrayLike, spacing: float, origin: Tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Mesh: ...
def distance(
    points: ArrayLike, triangles: ArrayLike, other_points: ArrayLike, other_triangles: ArrayLike
) -> Distance: ...
def thread_count() -> int: ...
def limit_threads(count: int) -> None: ...

class Recipe:
    notes: List[str]
    def __init__(
        self, source: Union[str, PathLike[str], Dict[str, Any]], settings: Optional[Mapping[str, Any]] = None
    ) -> None: ...
    def __getitem__(self, key: str) -> Any: ...
    def __setitem__(self, key: str, value: Any) -> None: ...

class Points(Protocol):
    """Argument of a law for the speed: points of the surface. Every array has one row a point."""

    step: str  # name of the recipe's step
    count: int
    fluxes: Dict[str, Floats]  # by name, relative to an open plane
    coverages: Dict[str, Floats]  # by name
    material: Ints  # id of the material under the point
    materials: Dict[str, int]  # ids by name
    normals: Floats  # (n, 3), unit length, pointing out of the material
    visible: NDArray[np.bool_]  # whether the source is in line of sight; only for models that ask for it
    speeds: Floats  # speeds by the recipe's model, in length per time

class TimeStep:
    time: float
    dt: float
    step: str
    measures: Dict[str, float]
    fluxes: Dict[str, Floats]
    def surface(self, around: Optional[int] = None) -> Mesh: ...
    def traced(self) -> Optional[Mesh]: ...
    def layers(self) -> List[Tuple[str, Mesh]]: ...
    def profile(self, plane: str = "y=0") -> List[Floats]: ...

class Simulation:
    recipe: Recipe
    output: Path
    summary: Optional[Dict[str, Any]]
    def __init__(
        self,
        recipe: Union[Recipe, str, PathLike[str], Dict[str, Any]],
        output: Union[None, str, PathLike[str]] = None,
        *,
        resume: bool = False,
        overwrite: bool = False,
        law: Optional[Callable[[Points], ArrayLike]] = None,
    ) -> None: ...
    def __iter__(self) -> Simulation: ...
    def __next__(self) -> TimeStep: ...
    def __enter__(self) -> Simulation: ...
    def __exit__(self, *_: object) -> None: ...
    def close(self) -> None: ...
