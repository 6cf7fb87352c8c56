#!/usr/bin/python3
"""A round hole as a profile in r and z against the same hole in space:
    tests/bench/round_against_3d.py BUILD [-n SEEDS, 2] [-f FINER, 1] [NAME...]
Quick recipes run both ways on one thread, on their grid spacing or one FINER times as fine, with as many rays as flux.accuracy asks
for, on the surface as extracted: coarsened meshes make the SF6/O2 hole 3 % shallower. Prints the CPU seconds of both and their ratio;
then for each surface that they save, but what is nearer to the cell's outer side than two grid spacings, with errors that are twice
the standard error by the seeds
- distances in grid spacings, of the surface in space from the profile, positive out of the material: means all around the axis, over
  the seeds and within squares of a grid spacing in r and z; of these the mean size, and the largest and where it is; then the largest
  of any vertex in space, and that of the profile from the nearest vertex in space
- the mean flux of each species in space over that on the profile, on the lowest tenth of the depth and above it in the hole
"""

import re
import sys
import tempfile
import zlib
from pathlib import Path

import numpy as np

from used import cpu_seconds_of

CONFIGS = Path(__file__).resolve().parents[2] / "configs/quick"
# Recipe, radius of the cell, grid spacing.
PAIRS = {
    "deposition": ("hole_deposition", 2.0, 0.2),
    "sf6o2": ("sf6o2_hole", 0.5, 0.0625),
    "contact": ("contact_round", 90.0, 5.0),
    "bosch": ("bosch_hole", 2.0, 0.125),
    "ald": ("ald_hole", 200.0, 40.0),
}


def read_vtp(path):
    """Points, triangles and the triangles' attributes of a surface that `run` wrote."""
    data = path.read_bytes()
    start = data.index(b"_", data.index(b"<AppendedData")) + 1
    kinds = {"Float64": "<f8", "Float32": "<f4", "Int32": "<i4", "Int64": "<i8", "UInt8": "u1"}
    arrays = {}
    of_triangles = data[data.index(b"<CellData>"):start]
    for head in re.findall(rb"<DataArray [^>]*format=\"appended\"[^>]*>", of_triangles):
        key = {k.decode(): v.decode() for k, v in re.findall(rb'(\w+)="([^"]*)"', head)}
        at = start + int(key["offset"])
        sizes = np.frombuffer(data, "<u8", int.from_bytes(data[at:at + 8], "little"), at + 24)
        at += 24 + 8 * len(sizes)
        ends = at + np.cumsum(sizes).astype(int)
        raw = b"".join(zlib.decompress(data[end - int(size):end]) for size, end in zip(sizes, ends))
        arrays[key["Name"]] = np.frombuffer(raw, kinds[key["type"]])
    points = arrays.pop("Points").reshape(-1, 3)
    triangles = arrays.pop("connectivity").reshape(-1, 3)
    return points, triangles, {name: values for name, values in arrays.items() if len(values) == len(triangles)}


class Surface:
    """A surface that a run saved, in r and z."""

    def __init__(self, path, around, extent):
        points, triangles, attributes = read_vtp(path)
        corners = points[triangles]
        middle = corners.mean(axis=1)
        self.area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        if around:
            self.middle = np.stack([np.hypot(middle[:, 0], middle[:, 1]), middle[:, 2]], axis=1)
            self.at = np.stack([np.hypot(points[:, 0], points[:, 1]), points[:, 2]], axis=1)
        else:
            self.middle = middle[:, [0, 2]]
            self.area = self.area * middle[:, 0]
            low = points[:, 1] == points[:, 1].min()
            edges = [(t[k], t[(k + 1) % 3]) for t in triangles for k in range(3) if low[t[k]] and low[t[(k + 1) % 3]]]
            flat = points[:, [0, 2]]
            self.segments = [(flat[a], flat[b]) for a, b in edges if (flat[a] != flat[b]).any()]
            shares = np.linspace(0.0, 1.0, 9)[:, None]
            self.at = np.concatenate([a + shares * (b - a) for a, b in self.segments])
        self.at = self.at[self.at[:, 0] < extent]
        self.flux = {name: values for name, values in attributes.items() if name.startswith("flux_")}

    def mean_flux(self, name, low, high):
        here = (self.middle[:, 1] > low) & (self.middle[:, 1] < high)
        return (self.area * self.flux[name])[here].sum() / self.area[here].sum()


def offsets(profile, at):
    """Signed distances of points from a profile, and the foot of each."""
    best, signed, feet = np.full(len(at), np.inf), np.zeros(len(at)), np.zeros_like(at)
    for a, b in profile.segments:
        length = np.hypot(*(b - a))
        unit = (b - a) / length
        foot = a + np.clip((at - a) @ unit, 0.0, length)[:, None] * unit
        distance = np.hypot(*(at - foot).T)
        out = (at - a) @ np.array([-unit[1], unit[0]])
        nearer = (distance < best - 1e-9 * length) | ((distance < best + 1e-9 * length) & (abs(out) > abs(signed)))
        best[nearer], signed[nearer], feet[nearer] = distance[nearer], out[nearer], foot[nearer]
    return best * np.sign(signed), feet


def by_squares(profile, at, spacing):
    """Mean signed distance from the profile in grid spacings, by square of the foot, and the largest of all."""
    distance, feet = offsets(profile, at)
    sums = {}
    for square, d in zip(map(tuple, np.floor(feet / spacing + 0.5).astype(int)), distance):
        sums.setdefault(square, []).append(d)
    return {square: np.mean(values) / spacing for square, values in sums.items()}, abs(distance).max() / spacing


def compare_surfaces(title, space, around, radius, spacing):
    """Of one moment, by seed."""
    reference = around[0]
    of_space, of_round = ([by_squares(reference, s.at, spacing) for s in surfaces] for surfaces in (space, around))
    squares = set.intersection(*(set(means) for means, _ in of_space + of_round))
    difference, error = {}, {}
    for square in squares:
        values = [np.array([means[square] for means, _ in some]) for some in (of_space, of_round)]
        difference[square] = values[0].mean() - values[1].mean()
        error[square] = 2 * np.sqrt(sum(v.var(ddof=1) / len(v) for v in values)) if len(space) > 1 else np.nan
    worst = max(squares, key=lambda square: abs(difference[square]))
    # Distance of each point of the profile to the nearest vertex in space.
    away = [min(np.hypot(*(s.at - q).T).min() for s in space) / spacing for q in reference.at]
    lost = reference.at[np.argmax(away)]
    print(f"  {title}: mean {np.mean(np.abs(list(difference.values()))):.3f} +- {np.mean(list(error.values())):.3f}, largest "
          f"{difference[worst]:+.3f} +- {error[worst]:.3f} at r {worst[0] * spacing:.4g}, z {worst[1] * spacing:.4g} of "
          f"{len(squares)}; any vertex {max(largest for _, largest in of_space):.2f}, from the profile {max(away):.2f} at r "
          f"{lost[0]:.4g}, z {lost[1]:.4g}")
    low = min(s.at[:, 1].min() for s in around + space)
    top = reference.at[reference.at[:, 0] > radius - 3 * spacing, 1].min()
    floor = low + 0.1 * (top - low)
    for flux in reference.flux:
        ratios = [np.mean([s.mean_flux(flux, *part) for s in space]) / np.mean([s.mean_flux(flux, *part) for s in around])
                  for part in ((low - spacing, floor), (floor, top - 1.5 * spacing))]
        print(f"    {flux}: floor {ratios[0]:.3f}, walls {ratios[1]:.3f}")


def compare(build, name, seeds, finer):
    recipe, radius, spacing = PAIRS[name]
    spacing /= finer
    cpu, folders = {"space": [], "round": []}, {"space": [], "round": []}
    with tempfile.TemporaryDirectory() as folder:
        for form, domain in (("space", [f"domain.extent=[{2 * radius}, {2 * radius}]", "domain.symmetry=none"]),
                             ("round", [f"domain.extent=[{radius}]", "domain.symmetry=axial"])):
            for seed in range(1, seeds + 1):
                out = Path(folder) / f"{form}{seed}"
                command = [build / "sidewall", "run", CONFIGS / f"{recipe}.toml", "--quiet", "--threads", 1, "-o", out]
                for setting in (*domain, f"domain.grid_spacing={spacing}", "flux.rays=0", "simplify.method=none",
                                "output.profiles=[]", f"flux.seed={seed}"):
                    command += ["--set", setting]
                cpu[form].append(cpu_seconds_of(command))
                folders[form].append(out)
        space, around = np.mean(cpu["space"]), np.mean(cpu["round"])
        print(f"{name}, grid spacing {spacing:g}: CPU {space:.2f} s in space, {around:.3f} s as a profile: {space / around:.1f}")
        for path in sorted(folders["round"][0].glob("surface_*.vtp"))[1:]:
            both = [[Surface(out / path.name, form == "space", radius - 2 * spacing) for out in folders[form]]
                    for form in ("space", "round")]
            compare_surfaces(path.stem, *both, radius, spacing)
        sys.stdout.flush()


def main(arguments):
    if not arguments:
        sys.exit(__doc__)
    build = Path(arguments.pop(0)).resolve()
    seeds, finer = 2, 1
    while arguments[:1] in (["-n"], ["-f"]):
        if arguments.pop(0) == "-n":
            seeds = int(arguments.pop(0))
        else:
            finer = int(arguments.pop(0))
    for name in arguments or PAIRS:
        compare(build, name, seeds, finer)


if __name__ == "__main__":
    main(sys.argv[1:])
