#pragma once
#include "levelset/block.hpp"

namespace sidewall::levelset {

/// Second differences of a distance, in cells, beyond which its front counts as turning sharply: a surface with a radius
/// of four cells does not.
inline constexpr float kSharpBend = 0.25f;

/// Distance of a node from a front, and whether an edge of it decides.
struct EdgeDistance {
    float cells;
    bool convex;  ///< the nearest point may lie on a convex edge
};

/// Distance of a node from a front that turns sharply near it, by the planes that the node's upwind neighbours lie over.
///
/// Beyond a convex edge the nearest point is the edge itself, which the planes on its two sides meet in (or the corner of
/// three planes); before a hollow edge it lies on the nearer of the planes. Differences along the axes are off by up to
/// 0.7 cells there: they take the values on both sides for one slanted front. The square of the distance from the common
/// part of two or three half-spaces is the maximum of d^T G^-1 d over the sets of them whose multipliers G^-1 d are not negative
/// (duality of the projection on a convex set; Boyd and Vandenberghe, Convex Optimization (2004), section 8.1.1), with d the
/// node's distances from the planes and G the products of their normals.
///
/// \param v        the node in a Block<2> with all of its values set, world units.
/// \param u        distance by differences along the axes, in cells, at least 0.
/// \param inv_dx   1 / dx, negative for nodes inside: values times this are distances in cells.
/// \param farthest half-width of the band in cells: values from here on are not known.
/// \returns u where the front does not turn sharply.
EdgeDistance edge_distance(const float* v, float u, float inv_dx, float farthest);

}  // namespace sidewall::levelset
