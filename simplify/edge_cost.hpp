#pragma once
#include "simplify/collapse_mesh.hpp"
#include "simplify/simplify_options.hpp"

namespace sidewall::simplify {

/// A collapse's place and cost; positions and lengths as CollapseMesh has them.
struct Candidate {
    Vec3 place;
    double cost = 0.0;
    double swept = 0.0;  ///< squared volume the triangles sweep, times 36
    double area2 = 0.0;  ///< sum of their squared areas, times 4: what that was the volume over
};

/// Cost and placement of collapsing an edge, after Lindstrom and Turk, Fast and memory efficient polygonal
/// simplification (1998): the volume is kept exactly, then the squared volume swept by the triangles is
/// least; on the boundary likewise for its area; where that leaves the place open, it goes to the middle of
/// the neighbours (triangle shape). The costs are those of CGAL's Lindstrom-Turk policies. Four deviations:
/// optima that are all but undetermined are pulled softly to the middle rather than by a threshold; a place
/// ten times farther from the edge than its neighbours becomes the midpoint; a trace of the shape cost
/// decides between edges of flat parts, which all cost nothing; and edges that take a needle along cost less,
/// or creases would keep those that marching cubes leave there.
///
/// Constant time, from the sums of both ends; only edges on the boundary visit their neighbours there.
/// \pre the edge may collapse: its merged_place() is not `nowhere`.
Candidate edge_cost(const CollapseMesh& mesh, std::uint32_t halfedge, const Weights& weights);

}  // namespace sidewall::simplify
