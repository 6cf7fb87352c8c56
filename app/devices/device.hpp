#pragma once
#include <functional>
#include <optional>

#include "app/results/result.hpp"
#include "surface/tetrahedra/tet_mesh.hpp"

// Meshes for device simulators.
namespace sidewall::app {

struct DeviceOptions {
    /// Longest edge near fronts; absent: 2 grid spacings, or more to make at most \p most tetrahedra.
    std::optional<double> size;
    std::size_t most = 200'000;
    std::optional<double>
        bottom;  ///< z of the underside; absent: 1/4 of the larger extent, at least 4 cells, below all fronts
    bool gas = false;                      ///< also mesh the gas above and in voids
    std::function<void(double)> progress;  ///< receives the share done, 0 to 1
};

/// A device mesh. Regions are materials; boundaries are `x-min`, `x-max`, `y-min`, `y-max`, `bottom`, `top`
/// of the gas, `surface` between materials and gas, and interfaces such as `Si/SiO2`, lower one first.
struct Device {
    TetMesh mesh;
    std::vector<double> volume;  ///< volume enclosed by the saved surfaces, by region
    double size = 0.0, bottom = 0.0;
    double drawn_out = 0.0;  ///< width along y to which a profile was stretched; 0 if it was not
};

/// Whether a result's wafer is a profile: at most 1.5 grid spacings wide along y.
bool is_profile(const Result& result, double spacing);

/// Meshes the wafer of a result. A profile, one cell wide along y, is first stretched to the width of four
/// edges, as no tetrahedron is longer than the slab is wide. The mesh is refined up to two times while the
/// volume of a region of over one cell is nearly 0.5 % off that enclosed by the surfaces.
///
/// \param result   a run's result, with its interfaces.
/// \param spacing  grid spacing of the run.
/// \throws RecipeError if the size or the bottom is impossible, if a material is called `gas` while the gas
///         is meshed, or, naming both figures, if memory does not suffice for the size; GeometryError if the
///         surfaces enclose no material.
Device make_device(const Result& result, double spacing, const DeviceOptions& options);

/// The plane mesh of a profile: the faces of its tetrahedra on the side `y-min`, with x and z as coordinates
/// x and y. Regions and boundaries keep their names. Edges between materials and gas are `surface`, others
/// between materials as in `Si/SiO2`.
/// \param mesh  a profile's mesh with boundaries, from make_device().
PlaneMesh plane_of(const TetMesh& mesh);

}  // namespace sidewall::app
