#pragma once
#include <cstddef>
#include <functional>
#include <vector>

#include "surface/distance.hpp"
#include "surface/error.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::surface {

/// Signed distance to the boundary of a body at a world point within the box, negative inside. Is called from
/// several threads at a time.
using Front = std::function<DistanceSample(const Vec3&)>;

/// Thrown if more tetrahedra are needed than the options allow.
struct TooManyTetrahedra : NumericsError {
    using NumericsError::NumericsError;
};

/// Options of tetrahedralize(). Lengths are in world units.
struct TetOptions {
    Box3 box;                    ///< filled by the tetrahedra
    double size = 0.0;           ///< longest edge near fronts
    double least = 0.0;          ///< no edge shorter than this is divided
    double tolerance = 0.0;      ///< largest distance of a front from edges longer than `least`
    double thin = 0.0;           ///< films thinner than this are left out
    double growth = 0.5;         ///< growth of the longest edge per distance from fronts
    double target_deg = 12.0;    ///< dihedral angles below this are improved
    bool outside = false;        ///< also mesh the space outside all bodies
    std::vector<int> material;   ///< material of each region, also of a meshed outside
    std::vector<double> volume;  ///< to be matched, by material; empty: none is
    double shift = 0.0;          ///< largest move of a vertex for matching volumes
    double scrap = 0.0;    ///< a material of at most this volume may move its vertices four times as far
    std::size_t most = 0;  ///< number of tetrahedra allowed; 0: any
    std::function<void(double)> progress;  ///< receives the share done, 0 to 1
};

}  // namespace sidewall::surface
