#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "flux/radiosity/profile_unknowns.hpp"
#include "flux/radiosity/ray_densities.hpp"
#include "flux/random.hpp"
#include "surface/triangle_mesh.hpp"

// Error of the linear elements in a solved flux, from the residual, which vanishes for the exact flux:
//
//     r(x) = direct(x) + mean over Lambert's rays from x of what their ends emit - flux(x) = 0
//
// Finite elements make r vanish only in the mean over every hat function; between vertices it bends. Extra
// rays measure this bend along edges of some triangles: r at the middle less the mean of r at the ends. The
// flux, linear along the edge, drops out. The rays of the three points have the same directions, so that the
// solution is a control variate: only differences between neighbouring ends are noise. Two sets of rays, each
// with the solution of one half of the exchange, have independent noise: the mean of their product estimates
// the mean square.
//
// The error's distribution over the surface comes from the solution: from the change of its recovered slope
// along each edge (Zienkiewicz and Zhu, Int. J. Numer. Methods Eng. 24, 1987), exact where the flux is smooth
// and the mesh fine. This estimate chooses the edges, and their rays give one factor that corrects it.
namespace sidewall::flux {

/// Directions in each of the two sets of rays of an edge; each is traced from three points.
constexpr std::uint32_t kResidualDirections = 16;
/// Residual rays as a share of a gather's other rays, until there are kMostResidualEdges edges.
constexpr double kResidualShare = 0.04;
constexpr std::size_t kMostResidualEdges = 1024;

/// The end of a residual ray: on a triangle, or with kNoTriangle outside. There `u` is the ray's cosine to
/// the vertical if it meets the source plane, else 0.
struct ResidualRay {
    std::uint32_t triangle;
    float u, v;
};

/// An edge of a triangle, from corner `edge` to the next; `density` is relative to a uniform choice.
struct ResidualEdge {
    std::uint32_t triangle, edge;
    double density;
};

/// The edges measured so far and their rays.
struct Residual {
    std::vector<ResidualEdge> edges;
    std::vector<ResidualRay> rays;  ///< by edge, set, direction and point (the two ends, then the middle)
    std::vector<double> share;   ///< shares of further edges, by triangle; empty: as the gather's rays start
    std::uint64_t segments = 0;  ///< ray-scene intersections
};

/// Adds edges and rays for a gather of \p rays other rays. Parallel; the same bits on any number of threads.
/// \param gather  number of the gather, a key of the random numbers.
void trace_residual(const Geometry& geometry, const RayDensities& densities, RandomKey key,
                    std::uint32_t gather, std::uint64_t rays, Residual& residual);

/// Shares of further edges, by triangle: 4/5 in proportion to area and expected \p error, 1/5 as rays start.
std::vector<double> shares_of_edges(const RayDensities& densities, std::span<const double> error);

/// Expected second differences of the flux (middle less mean of the ends) along the edges of every triangle,
/// from its recovered slope. Edge k of triangle t, which starts at corner k, is at 3 t + k. O(n).
/// \param flux  by wedge.
std::vector<double> expected_bends(const TriangleMesh& mesh, const Wedges& wedges,
                                   std::span<const double> flux);

/// Root mean square error of the linear elements over every triangle, from the \p bends of its edges.
std::vector<double> errors_of(std::span<const double> bends);

/// Root mean square of the bends measured by rays over that of the expected \p bends; 1 for under 16 edges.
/// \param one, other        emission by unknown, solved from two halves of the rays.
/// \param source, exponent  flux of the source on an open plane, and its exponent n.
double bend_factor(const Geometry& geometry, const ProfileUnknowns& profile, const Residual& residual,
                   std::span<const double> bends, std::span<const double> one, std::span<const double> other,
                   double source, double exponent);

}  // namespace sidewall::flux
