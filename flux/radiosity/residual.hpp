#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "flux/radiosity/profile_unknowns.hpp"
#include "flux/radiosity/ray_densities.hpp"
#include "flux/random.hpp"
#include "surface/triangle_mesh.hpp"

// What linear elements add to the error of a solved flux. A flux that were exact would be what arrives by
// itself:
//
//     r(x) = direct(x) + mean over Lambert's rays from x of what their ends emit - flux(x) = 0
//
// Elements make r vanish in the mean over every hat function, so that what is left bends between the
// vertices. Along edges of some triangles rays of their own look for it: r at the middle less the mean of r
// at the ends. Of the flux itself, which is linear there, nothing is left, and the rays of the three points
// have the same directions, so that only differences between neighbours are noise: the solution is a control
// variate. Two sets of rays, each with the solution of one half of the exchange, have independent noise: the
// mean of their product is the mean square of what both see.
//
// How r is spread over the surface no few edges tell, but the solution does: by how much its slope changes
// along each (Zienkiewicz and Zhu's recovered gradients, Int. J. Numer. Methods Eng. 24, 1987). That
// estimate, exact where the flux is smooth and the mesh fine, decides which edges are looked at, and they
// measure by how much it is off.
namespace sidewall::flux {

/// Directions of either set of rays; each is followed from three points.
constexpr std::uint32_t kResidualDirections = 16;
/// A gather's rays of the residual are this share of its others, until there are kMostLooks edges.
constexpr double kResidualShare = 0.04;
constexpr std::size_t kMostLooks = 1024;

/// Where a ray from a point ends: at a triangle, or with kNoTriangle outside, where `u` is its cosine to the
/// vertical if it comes from the source plane, else 0.
struct ResidualRay {
    std::uint32_t triangle;
    float u, v;
};

/// An edge of a triangle, from corner \p edge to the next, drawn with a `density` relative to that of drawing all alike.
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

/// Second differences of the flux along the edges of every triangle, at its middle less the mean of its ends, as the change of
/// its slope tells: of edge k of triangle t, from corner k on, at 3 t + k. O(n).
/// \param flux  by wedge.
std::vector<double> expected_bends(const TriangleMesh& mesh, const Wedges& wedges,
                                   std::span<const double> flux);

/// Root mean square over every triangle of what linear elements are off by with these \p bends.
std::vector<double> errors_of(std::span<const double> bends);

/// By what factor the \p bends are off as the rays see it: 1 where these are too few to tell.
/// \param one, other  what every unknown emits, as two halves of the rays tell.
/// \param source      flux of the source on an open plane, cos^exponent.
double bend_factor(const Geometry& geometry, const Strip& strip, const Residual& residual,
                   std::span<const double> bends, std::span<const double> one, std::span<const double> other,
                   double source, double exponent);

}  // namespace sidewall::flux
