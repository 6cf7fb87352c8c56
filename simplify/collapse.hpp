#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "simplify/collapse_worker.hpp"

namespace sidewall::simplify {

/// A mesh being coarsened by edge collapses, cheapest Lindstrom-Turk cost first (edge_cost.hpp). The mesh is
/// taken apart once, passes share it, take_mesh puts it together. Large meshes are worked on block by block
/// in parallel, all blocks up to the same cost, and the seams between blocks after that.
///
/// What a pass keeps:
/// - Boundary: its vertices move along it only; those in an x or y extreme of the mesh keep that coordinate
///   to the last bit, corners stay, and an edge that ends on the boundary collapses onto its boundary vertex
///   (vertex_kind.hpp).
/// - Vertices where triangles of different `material` meet: edges that touch them stay.
/// - Vertices fixed by the caller, likewise: both sides of a periodic domain must keep the same curve.
/// - Orientation: no triangle turns by 90 degrees or more in a collapse.
/// - Shape: the least angle around an edge gets no smaller once it is below 5 degrees, and no triangle
///   becomes degenerate.
/// - Manifoldness and Euler number (link condition).
/// - Box: no vertex leaves that of the input.
/// - Degree: no collapse makes a vertex of more than 64 neighbours.
/// A placement far outside of the edge's neighbourhood, where constraints are near-singular, becomes the
/// midpoint.
class CollapseEngine {
  public:
    /// Keeps a reference to \p mesh; of the options it takes the weights, the fixed vertices and the progress.
    /// \throws GeometryError if the mesh is not an orientable manifold, `material` is not one number a
    ///         triangle or the fixed flags have another length than the vertices.
    CollapseEngine(const TriangleMesh& mesh, const Options& options);

    /// Features, one flag an input vertex; a merged vertex is one if either was. The region starts out as the
    /// features.
    void set_features(std::span<const std::uint8_t> features);

    /// Bounds on the length of edges that may collapse, per input vertex, infinity for none: graded ones,
    /// which a pass may scale, and fixed ones. Either may be empty. The shorter one of an edge's ends counts,
    /// and a merged vertex takes it.
    /// \throws GeometryError on another number of lengths.
    void set_max_lengths(std::span<const double> graded, std::span<const double> fixed);

    /// Makes the features the region again.
    void reset_region();
    /// Adds all neighbours to the region.
    /// \returns how many.
    std::size_t grow_region();

    /// \returns how many vertices it removed. O(n), parallel; the result does not depend on threads.
    std::size_t run(const CollapsePass& pass);

    /// Vertices left, those no triangle uses not counted.
    std::size_t vertex_count() const { return vertices_; }
    /// Lengths of the shortest and the longest edge with no end in the region or frozen. Infinity and 0 if there
    /// is none.
    std::pair<double, double> transition_edges() const;

    /// The mesh as it is now: vertices and triangles in the input's order, unmoved vertices bit for bit,
    /// per-triangle `material` carried along, other attributes and unused vertices left out.
    TriangleMesh take_mesh() const;

  private:
    /// Collapses inside of blocks, in parallel, all up to the same cost, until the blocks' share of \p excess
    /// vertices is gone.
    void run_blocks(std::size_t excess);
    /// Collapses anywhere until the target is met or nothing more can go.
    void run_everywhere();

    const TriangleMesh& input_;
    CollapseState state_;
    std::size_t vertices_ = 0;                ///< left
    RecentDistances distances_;               ///< of all workers
    std::vector<BucketQueue::Bucket> where_;  ///< per halfedge: bucket its edge is queued in
};

}  // namespace sidewall::simplify
