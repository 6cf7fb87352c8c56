#pragma once
#include <cstddef>
#include <functional>
#include <vector>

#include "surface/distance.hpp"
#include "surface/error.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::surface {

/// The signed distance to the boundary of a body at a world point within the box, negative inside. Called from many
/// threads.
using Front = std::function<DistanceSample(const Vec3&)>;

/// More tetrahedra are needed than the options allow.
struct TooManyTetrahedra : NumericsError {
    using NumericsError::NumericsError;
};

/// How fine tetrahedra are. Lengths are in world units.
struct TetOptions {
    Box3 box;                    ///< that they fill
    double size = 0.0;           ///< longest edge at fronts
    double least = 0.0;          ///< no edge shorter than this is divided
    double tolerance = 0.0;      ///< how far a front may bulge over an edge that is longer than \p least
    double thin = 0.0;           ///< less than this between two fronts is nothing
    double growth = 0.5;         ///< of edges, by distance from the fronts
    double target_deg = 12.0;    ///< angles between faces that are improved if they are smaller
    bool outside = false;        ///< mesh what is in no body, too
    std::vector<int> material;   ///< by region, the outside's too if it is meshed
    std::vector<double> volume;  ///< by material, as the mesh is to have it; empty: as it comes
    double shift = 0.0;          ///< how far a vertex of a front may move for that
    double scrap = 0.0;          ///< vertices of a material of at most this volume may move four times as far
    std::size_t most = 0;        ///< tetrahedra; more are refused; 0: any number
    std::function<void(double)> progress;  ///< gets the share done
};

}  // namespace sidewall::surface
