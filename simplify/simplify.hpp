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
    std::size_t removed = 0;  ///< vertices removed
};

/// Wall-clock seconds; 0 where not measured.
struct Seconds {
    double features = 0.0;  ///< feature detection; filled in by the caller that did it
    double collapse = 0.0;  ///< from input arrays to output arrays
    double total = 0.0;
};

/// A simplified mesh and a record of the passes.
struct Result {
    TriangleMesh mesh;
    std::vector<PassReport> passes;  ///< in order; a region schedule with l0 > 0 begins with the whole mesh
    std::vector<std::string> dropped_attributes;  ///< all of the input's but the per-triangle `material`
    Seconds seconds;
};

/// Coarsens \p mesh by the method and lengths of \p options; "auto" comes from the grid spacing or the mesh.
///
/// \param mesh      orientable manifold, open or closed; its boundary, material borders, orientation and
///                  Euler number are kept as CollapseEngine says.
/// \param features  one flag a vertex for the region methods; the others ignore it.
/// \returns the mesh, the vertices each pass removed and the seconds taken (not those for finding features).
/// \throws RecipeError for values out of range and for max_error with CGAL's method; GeometryError if the
///         mesh is no such manifold, or features or lengths are not one a vertex.
/// \note O(n) a pass, CGAL's O(n log n); deterministic for a given mesh, whatever the number of threads.
Result simplify(const TriangleMesh& mesh, std::span<const std::uint8_t> features, const Options& options);

/// Coarsens \p mesh by one rule everywhere: cheapest edge first (Lindstrom and Turk 1998), until the vertex
/// target is met or no edge shorter than l_max can collapse. A collapse that would cut off a peak of the
/// input is postponed: its edge is queued again at twice the cost (see Witness).
/// \throws as simplify does.
Result simplify_lindstrom_turk(const TriangleMesh& mesh, const Options& options);

/// Coarsens \p mesh away from its features, ring by ring (Lenz 2023, section 8.2). The first pass collapses
/// edges shorter than l0 in the whole mesh. The second takes edges shorter than l0 + step in the transition
/// region: the edges with no end in the feature region. Before each further pass the feature region grows by
/// its neighbours and the length by options.step. The passes end when the length reaches l_max, or when
/// nothing collapses although an edge is short enough. No edge collapses at a vertex where materials meet.
/// With a vertex target l_max is ignored; passes that end short of it start again with l0 and step a quarter
/// longer.
///
/// \param features  one flag a vertex: true keeps resolution l0 there; if l0 = 0, the exact vertex.
/// \throws as simplify does; RecipeError also if the step is below a thousandth of the mean edge length.
Result simplify_regions(const TriangleMesh& mesh, std::span<const std::uint8_t> features,
                        const Options& options);

/// Region simplification with a bound on the error, safe where feature detection missed something. Every
/// collapse keeps to options.max_error. The edge length allowed is l0 at a feature, grows by options.step per
/// edge of distance from the nearest feature up to l_max, and never exceeds max_length_at. Within these
/// bounds the cheapest edge of the whole mesh collapses first.
///
/// With a target vertex count, l_max does not apply. The error bound starts tight, below a hundredth of l0 +
/// step; it and the graded lengths are relaxed round by round until the target is met, so that the vertices
/// left concentrate where the surface needs them. The bounds max_error and max_length_at always hold.
///
/// \param features  one flag a vertex, or empty: then only max_error, max_length_at and l_max bound.
/// \returns the simplified mesh; its passes are the rounds of relaxation, and their length is that allowed
///          farthest from features (infinity: no bound).
/// \throws as simplify does.
Result simplify_regions_bounded(const TriangleMesh& mesh, std::span<const std::uint8_t> features,
                                const Options& options);

}  // namespace sidewall::simplify
