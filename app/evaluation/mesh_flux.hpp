#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "flux/lateral.hpp"
#include "flux/wedges.hpp"
#include "surface/ray_scene.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// A mesh on which a neutral's fluxes are calculated, to be read at the vertices of another mesh of the same surface. Keeps a
/// reference to the mesh.
struct MeshFlux {
    MeshFlux(const TriangleMesh& mesh, const TriangleMesh& surface, const flux::LateralBox& box);

    /// The flux by wedge, by Monte Carlo tracing from the source.
    /// \param seconds  grows by the CPU seconds of all threads: what else runs on the machine weighs little.
    std::vector<double> traced(double rays, double sticking, std::uint64_t seed, double& seconds) const;
    /// The flux by wedge, by radiosity: traces \p rays between points of the mesh and solves the sparse system.
    /// \param errors  estimates the standard errors, too.
    std::vector<double> solved(double rays, double sticking, std::uint64_t seed, bool errors,
                               double& seconds) const;
    /// The quantity \p by_wedge at the vertices of the surface, linear over the nearest triangle of the mesh.
    std::vector<double> at_vertices(std::span<const double> by_wedge) const;

    double bvh_seconds = 0.0;    ///< CPU seconds to build the hierarchy
    double wedge_seconds = 0.0;  ///< and to find creases
    const TriangleMesh& mesh;
    flux::LateralBox box;
    surface::RayScene scene;
    flux::Wedges wedges;
    std::vector<surface::SurfaceHit> nearest;  ///< points of the mesh to the vertices of the surface
};

/// Averages each vertex's value with its neighbours', area-weighted, \p rounds times; creases are not crossed.
std::vector<double> smoothed(std::vector<double> values, const TriangleMesh& surface, int rounds);

}  // namespace sidewall::app
