#pragma once
#include <functional>
#include <optional>

#include "app/results/result.hpp"
#include "surface/tetrahedra/tet_mesh.hpp"

// Meshes for device simulators.
namespace sidewall::app {

struct DeviceOptions {
    /// Longest edge at fronts; else 2 grid spacings, or what makes no more than \p most tetrahedra.
    std::optional<double> size;
    std::size_t most = 200'000;
    std::optional<double>
        bottom;        ///< z of the underside; else a quarter of the larger extent below all fronts
    bool gas = false;  ///< mesh what is above and in voids, too
    std::function<void(double)> progress;  ///< gets the share done
};

/// Tetrahedra of all materials. Regions are materials; boundaries are `x-min`, `x-max`, `y-min`, `y-max`, `bottom`,
/// `top` of the gas, `surface` between materials and gas, and interfaces such as `Si/SiO2`, the lower one first.
struct Device {
    TetMesh mesh;
    std::vector<double> volume;  ///< by region, as the saved surfaces enclose it
    double size = 0.0, bottom = 0.0;
    double drawn_out = 0.0;  ///< width along y of a profile's slab; 0 of a wafer that has its own
};

/// Whether a result's wafer is a profile: a cell wide along y, and the same at all y.
bool is_profile(const Result& result, double spacing);

/// Meshes the wafer of a result. A profile, a cell wide along y, is drawn out to four edges, as no tetrahedron is longer than
/// the slab is wide. A region of more than a few cells whose volume differs from what the surfaces enclose by
/// nearly 0.5 % is meshed finer, up to two times.
///
/// \param result   of a run, with its interfaces.
/// \param spacing  of the grid that it was run on.
/// \throws RecipeError if the size or the bottom cannot be, if a material is called `gas` beside the gas, or naming both
///         figures if there is not the memory for what the size asks for; GeometryError if the surfaces enclose no material.
Device make_device(const Result& result, double spacing, const DeviceOptions& options);

/// The triangles in which the tetrahedra of a profile, a wafer that is the same at all y, meet its side of least y: x and
/// height become x and y of the plane. Regions and boundaries keep their names; edges between materials and gas are
/// `surface`, others between materials as in `Si/SiO2`.
/// \param mesh  with its boundaries, as make_device makes it.
PlaneMesh plane_of(const TetMesh& mesh);

}  // namespace sidewall::app
