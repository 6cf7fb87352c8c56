#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "simplify/simplify_options.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::simplify {

/// Result of one pass over the mesh.
struct PassReport {
    double length = 0.0;      ///< only edges shorter than this could collapse
    std::size_t removed = 0;  ///< vertices
};

/// Wall-clock seconds; 0 where not measured.
struct Seconds {
    double features = 0.0;  ///< finding them: filled in by whoever did
    double collapse = 0.0;  ///< from our arrays to our arrays
    double total = 0.0;
};

/// A simplified mesh and how it came about.
struct Result {
    TriangleMesh mesh;
    std::vector<PassReport> passes;  ///< in order; a region schedule with l0 > 0 begins with the whole mesh
    std::vector<std::string> dropped_attributes;  ///< the output carries none but the per-triangle `material`
    Seconds seconds;
};

/// Coarsens \p mesh by the method and lengths of \p options; "auto" comes from the grid spacing or the mesh.
///
/// \param mesh      orientable manifold, open or closed; its boundary, material borders, orientation and Euler
///                  number are kept as CollapseEngine says.
/// \param features  one flag a vertex; only the region methods read them, the others take an empty span.
/// \returns the mesh, the vertices each pass removed and the seconds taken (not those for finding features).
/// \throws RecipeError for values out of range and for max_error with CGAL's method; GeometryError on another
///         mesh, or if the features or lengths are not one a vertex.
/// \note O(n) a pass, CGAL's O(n log n); deterministic for a given mesh, whatever the number of threads.
Result simplify(const TriangleMesh& mesh, std::span<const std::uint8_t> features, const Options& options);

/// Coarsens \p mesh everywhere by the same rule: cheapest edge first (Lindstrom and Turk 1998), until the
/// target or the edge length l_max is reached, or nothing more can go. A collapse that would leave a peak of the
/// input far behind waits until others cost as much; see Witness.
/// \throws as simplify does.
Result simplify_lindstrom_turk(const TriangleMesh& mesh, const Options& options);

/// Coarsens \p mesh away from its features, ring by ring (Lenz 2023, section 8.2): the whole mesh with edge
/// length l0; then, outside of the feature region, with l0 + step; then the region takes in its neighbours,
/// the length grows by options.step again, and so on, until it reaches l_max or nothing collapses although an
/// edge is short enough. An edge belongs to the transition region if neither end is in the feature region.
/// Vertices where materials meet count as features that l0 does not touch either. Where the passes end short of a
/// target, they start again with l0 and step a quarter longer.
///
/// \param features  one flag a vertex: true keeps the resolution l0 there; with l0 = 0 such vertices stay bit
///                  for bit.
/// \throws as simplify does; RecipeError, too, on a step below a thousandth of the mean edge.
Result simplify_regions(const TriangleMesh& mesh, std::span<const std::uint8_t> features,
                        const Options& options);

/// A region simplification that is safe where features are missed: every edge keeps to options.max_error, and
/// the length allowed to it grows with its distance to the nearest feature, by options.step an edge from
/// l0 at the feature itself, up to l_max, and is nowhere more than max_length_at. Within these bounds the
/// cheapest edge goes first, all over the mesh at once. With a target vertex count the bounds start tight,
/// below a hundredth of l0 + step for the error, and all but max_error and max_length_at are relaxed where
/// they stand in the way of the target: the vertices that are left go where the surface needs them.
///
/// \param features  one flag a vertex, or empty: then only max_error and max_length_at bound.
/// \returns the simplified mesh; its passes are the rounds of relaxation, their lengths those allowed
///          farthest from features, infinite where nothing bounds them.
/// \throws as simplify does.
Result simplify_regions_bounded(const TriangleMesh& mesh, std::span<const std::uint8_t> features,
                                const Options& options);

}  // namespace sidewall::simplify
