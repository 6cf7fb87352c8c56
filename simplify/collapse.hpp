#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "simplify/collapse_worker.hpp"

namespace sidewall::simplify {

/// Coarsens a mesh by edge collapses, cheapest Lindstrom-Turk cost first (edge_cost.hpp). All passes work on
/// one halfedge mesh; take_mesh() makes the result. Blocks of a large mesh are coarsened in parallel, all up
/// to the same cost, and the seams between them after that.
///
/// Guarantees of a pass:
/// - Boundary: its vertices move along it only; those in an x or y extreme of the mesh keep that coordinate
///   to the last bit, corners stay, and an edge with one end on the boundary collapses onto that end.
/// - Materials: edges at vertices where triangles of different `material` meet do not collapse.
/// - Vertices fixed by the caller: their edges do not collapse, so that periodic sides can stay equal.
/// - Orientation: no triangle turns by 90 degrees or more in a collapse.
/// - Shape: no collapse lowers the least angle around its edge below 5 degrees, or further if it is below
///   already; no triangle becomes degenerate.
/// - Manifoldness and Euler number (link condition).
/// - Box: no vertex leaves the bounding box of the input.
/// - Degree: no collapse makes a vertex of more than 64 neighbours.
/// - Reach: a place far from the edge's neighbourhood (near-singular constraints) becomes the midpoint.
class CollapseEngine {
  public:
    /// Keeps a reference to \p mesh. Reads weights, fixed vertices and progress of the options.
    /// \throws GeometryError if the mesh is not an orientable manifold, `material` is not one number a
    ///         triangle or the fixed flags are not one a vertex.
    CollapseEngine(const TriangleMesh& mesh, const Options& options);

    /// Sets features, one flag an input vertex, and the region to them. A merged vertex inherits the flag.
    /// \throws GeometryError on another number of flags.
    void set_features(std::span<const std::uint8_t> features);

    /// Bounds the length of edges that may collapse, per input vertex (infinity: no bound). Passes scale
    /// \p graded by their length_factor, but not \p fixed; either may be empty. The smaller bound of an
    /// edge's ends counts, and the merged vertex keeps it.
    /// \throws GeometryError on another number of lengths.
    void set_max_lengths(std::span<const double> graded, std::span<const double> fixed);

    /// Shrinks the region to the features.
    void reset_region();
    /// Adds all neighbours of the region's vertices to the region.
    /// \returns how many vertices it added.
    std::size_t grow_region();

    /// Runs one pass. O(n), parallel; the result does not depend on the number of threads.
    /// \returns how many vertices it removed.
    std::size_t run(const CollapsePass& pass);

    /// Number of vertices left, without those that no triangle uses.
    std::size_t vertex_count() const { return vertices_; }
    /// Shortest and longest length of an edge without an end in the region or frozen; infinity and 0 if none.
    std::pair<double, double> transition_edges() const;

    /// The coarsened mesh: vertices and triangles in the input's order, unmoved vertices unchanged bit for
    /// bit, with the per-triangle `material`, without other attributes and unused vertices.
    TriangleMesh take_mesh() const;

  private:
    /// Collapses edges inside blocks, in parallel, to a common cost, for their share of \p excess vertices.
    void run_blocks(std::size_t excess);
    /// Collapses edges of the whole mesh until the target is met or no edge may collapse.
    void run_everywhere();

    const TriangleMesh& input_;
    CollapseState state_;
    std::size_t vertices_ = 0;                ///< number of vertices left
    RecentDistances distances_;               ///< mean of those of all workers
    std::vector<BucketQueue::Bucket> where_;  ///< per halfedge: bucket its edge is queued in
};

}  // namespace sidewall::simplify
