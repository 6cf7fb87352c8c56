#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "flux/radiosity/profile_unknowns.hpp"
#include "flux/radiosity/ray_densities.hpp"
#include "flux/random.hpp"
#include "surface/triangle_mesh.hpp"

// Error of linear elements in a solved flux, by the residual of the balance, which vanishes for the exact
// flux:
//
//     r(x) = direct(x) + mean over Lambert's rays from x of what their ends emit - flux(x) = 0
//
// Elements make r vanish in the mean over every hat function, so that r bends between the vertices. Extra
// rays measure this bend along edges of some triangles: r at the middle less the mean of r at the ends. The
// flux itself, which is linear there, drops out, and the rays of the three points have the same directions,
// so that only differences between neighbours are noise: the solution is a control variate. Two sets of rays,
// each with the solution of one half of the exchange, have independent noise: the mean of their product
// estimates the mean square.
//
// A few edges do not show how r is spread over the surface. The solution does, by the change of its slope
// along each edge (Zienkiewicz and Zhu's recovered gradients, Int. J. Numer. Methods Eng. 24, 1987). That
// estimate, exact where the flux is smooth and the mesh fine, chooses the edges, and their rays give the
// factor by which it is off.
namespace sidewall::flux {

/// Directions of either set of rays; each is followed from three points.
constexpr std::uint32_t kResidualDirections = 16;
/// Rays for the residual as a share of a gather's others, until there are kMostResidualEdges edges.
constexpr double kResidualShare = 0.04;
constexpr std::size_t kMostResidualEdges = 1024;

/// The end of a residual ray: at a triangle, or with kNoTriangle outside, where `u` is its cosine to the vertical
/// if it comes from the source plane, else 0.
struct ResidualRay {
    std::uint32_t triangle;
    float u, v;
};

/// An edge of a triangle, from corner `edge` to the next, drawn with a `density` relative to a uniform choice.
struct ResidualEdge {
    std::uint32_t triangle, edge;
    double density;
};

struct Residual {
    std::vector<ResidualEdge> edges;
    std::vector<ResidualRay> rays;  ///< by edge, set, direction and point: the two ends and the middle
    std::vector<double> share;      ///< of the edges to come, by triangle; empty: as the gather's rays start
    std::uint64_t segments = 0;
};

/// Adds edges and their rays for a gather of \p rays others. Parallel; the same bits on any number of threads.
/// \param gather  its number.
void trace_residual(const Geometry& geometry, const RayDensities& densities, RandomKey key,
                    std::uint32_t gather, std::uint64_t rays, Residual& residual);

/// Shares of edges to come, by triangle, for an \p error expected there: most in proportion to it, the others as rays
/// start.
std::vector<double> shares_of_edges(const RayDensities& densities, std::span<const double> error);

/// Expected second differences of the flux along the edges of every triangle, middle less the mean of the ends,
/// from the change of its recovered slope: edge k of triangle t, from corner k on, at 3 t + k. O(n).
/// \param flux  by wedge.
std::vector<double> expected_bends(const TriangleMesh& mesh, const Wedges& wedges,
                                   std::span<const double> flux);

/// Root mean square error of linear elements over every triangle for these \p bends.
std::vector<double> errors_of(std::span<const double> bends);

/// The factor from the expected \p bends to those that the rays measure; 1 if there are too few rays.
/// \param one, other  emission by unknown, from two halves of the rays.
/// \param source      flux of the source on an open plane, cos^exponent.
double bend_factor(const Geometry& geometry, const ProfileUnknowns& profile, const Residual& residual,
                   std::span<const double> bends, std::span<const double> one, std::span<const double> other,
                   double source, double exponent);

}  // namespace sidewall::flux
