#pragma once
#include "levelset/block.hpp"

namespace sidewall::levelset {

/// Second difference of a distance along an axis, in cells, above which the front counts as turning sharply.
/// A surface with a radius of curvature of four cells does not exceed it.
inline constexpr float kSharpBend = 0.25f;

/// Distance of a node from the front, and whether an edge may decide it.
struct EdgeDistance {
    float cells;
    bool convex;  ///< the nearest point may lie on a convex edge
};

/// Distance of a node from a front that turns sharply, by the planes nearest to the node's upwind neighbours.
///
/// Beyond a convex edge the nearest point lies on the edge, in which two planes meet, or in the corner of
/// three; before a hollow edge it lies on the nearer plane. Differences along the axes take the planes for
/// one slanted front and are off by up to 0.7 cells there. The squared distance from the intersection of two
/// or three half-spaces is the maximum of d^T G^-1 d over those subsets of them whose multipliers G^-1 d are
/// not negative (duality of the projection on a convex set; Boyd and Vandenberghe, Convex Optimization
/// (2004), section 8.1.1), d: distances from the planes, G: Gram matrix of the normals.
///
/// \param v        the node's place in a Block<2> filled by load_block; world units.
/// \param u        the distance by differences along the axes, in cells, at least 0.
/// \param inv_dx   1 / dx, negative for nodes inside: values times this are distances in cells.
/// \param farthest half-width of the band in cells: values from here on are not known.
/// \returns u where the front does not turn sharply.
EdgeDistance edge_distance(const float* v, float u, float inv_dx, float farthest);

}  // namespace sidewall::levelset
