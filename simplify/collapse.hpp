#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <utility>

#include "simplify/simplify_options.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::simplify {

/// Rules for one pass of edge collapses.
struct CollapsePass {
    double max_length = 0.0;          ///< only edges shorter than this collapse
    std::size_t target_vertices = 0;  ///< the pass ends when no more than this many are left
    bool keep_region = false;         ///< edges with an end in the region stay as they are
    /// No vertex of the input may come to lie farther from the simplified surface, nor the other way round.
    double max_error = std::numeric_limits<double>::infinity();
    /// The pass ends as soon as max_error has refused more edges than have collapsed, instead of trying all.
    bool stop_when_refused = false;
    /// A collapse that would leave a point of the input much farther from the surface than recent ones did
    /// waits until others cost twice as much (witness.hpp).
    bool defer_outliers = false;
    double length_factor = 1.0;  ///< applied to the graded lengths
};

/// A mesh being coarsened by edge collapses, cheapest Lindstrom-Turk cost first (edge_cost.hpp). The mesh is
/// taken apart once, passes share it, take_mesh puts it together. Large meshes are worked on block by block
/// in parallel (blocks.hpp), all blocks up to the same cost, and their seams after that.
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
    /// Keeps a reference to \p mesh, none to \p fixed: one flag a vertex, or empty.
    /// \throws GeometryError if the mesh is not an orientable manifold, `material` is not one number a
    ///         triangle or \p fixed has another length than the vertices.
    CollapseEngine(const TriangleMesh& mesh, const Weights& weights, std::span<const std::uint8_t> fixed);
    ~CollapseEngine();

    /// Features, one flag an input vertex; a merged vertex is one if either was. The region starts out as the
    /// features.
    void set_features(std::span<const std::uint8_t> features);

    /// Bounds on the length of edges that may collapse, per input vertex, infinity for none: graded ones,
    /// which a pass may scale, and fixed ones. Either may be empty. The shorter one of an edge's ends counts,
    /// and a merged vertex takes it.
    /// \throws GeometryError on another number of lengths.
    void set_max_lengths(std::span<const double> graded, std::span<const double> fixed);

    /// Calls \p progress with about how many vertices are left, now and then, one call at a time, from any
    /// thread.
    void report_to(std::function<void(std::size_t)> progress);

    /// Makes the features the region again.
    void reset_region();
    /// Adds all neighbours to the region.
    /// \returns how many.
    std::size_t grow_region();

    /// \returns how many vertices it removed. O(n), parallel; the result does not depend on threads.
    std::size_t run(const CollapsePass& pass);

    /// Vertices left, those no triangle uses not counted.
    std::size_t vertex_count() const;
    /// Lengths of the shortest and the longest edge with no end in the region. Infinity and 0 if there is none.
    std::pair<double, double> transition_edges() const;

    /// The mesh as it is now: vertices and triangles in the input's order, unmoved vertices bit for bit,
    /// per-triangle `material` carried along, other attributes and unused vertices left out.
    TriangleMesh take_mesh() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace sidewall::simplify
