#pragma once
#include "simplify/collapse_mesh.hpp"
#include "simplify/simplify_options.hpp"

namespace sidewall::simplify {

/// Place and cost of a collapse, in the scaled coordinates of CollapseMesh.
struct Candidate {
    Vec3 place;
    double cost = 0.0;
    double swept = 0.0;  ///< sum of the squared volumes that the triangles sweep, times 36
    double area2 = 0.0;  ///< sum of their squared areas, times 4; swept / area2 is a mean squared distance
};

/// Cost and placement of an edge collapse after Lindstrom and Turk, Fast and memory efficient polygonal
/// simplification (1998): the place keeps the volume exactly and minimises the squared volume swept by the
/// triangles; on the boundary likewise for the area. If that leaves it undetermined, it goes to the mean of
/// the neighbours (triangle shape). Costs are those of CGAL's Lindstrom-Turk policies. Four deviations:
/// - Nearly undetermined optima are pulled softly to the mean, instead of by a threshold.
/// - A place ten times farther from the edge's midpoint than its neighbours becomes the midpoint.
/// - A trace of the shape cost decides between edges of flat parts, whose other costs are all zero.
/// - Edges whose collapse removes a needle cost less, or creases would keep the needles of marching cubes.
/// \note Constant time, from the sums of both ends; O(degree) for ends on the boundary.
/// \pre the edge may collapse: its merged_place() is not `nowhere`.
Candidate edge_cost(const CollapseMesh& mesh, std::uint32_t halfedge, const Weights& weights);

}  // namespace sidewall::simplify
