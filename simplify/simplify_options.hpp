#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string_view>

#include "surface/triangle_mesh.hpp"

namespace sidewall::simplify {

/// How a mesh is coarsened. Hyphenated in recipes and on the command line, e.g. `lindstrom-turk`.
enum class Method {
    none,                 ///< no simplification
    lindstrom_turk,       ///< Lindstrom-Turk cost, no regions
    region,               ///< features kept fine, flat parts coarsened ring by ring
    cgal_lindstrom_turk,  ///< Lindstrom-Turk on CGAL's edge collapse, the reference implementation
    region_bounded        ///< edge lengths graded by region, and a bound on the distance to the input
};

std::string_view to_string(Method method);

/// Whether the method is one of the region methods, which read features.
bool reads_features(Method method);

/// \throws RecipeError naming the known methods.
Method method_from_string(std::string_view name);

/// Weights of the terms of Lindstrom and Turk's cost. Only their ratios matter.
struct Weights {
    double volume = 0.5;    ///< squared volume swept by the moved triangles
    double boundary = 0.5;  ///< squared area swept by the moved boundary edges
    double shape = 0.0;  ///< squared distances to the neighbours; more of it makes triangles more equilateral
};

/// Default of CGAL and of every method here: smallest distance to the input (tests/bench/simplify_bench.cpp).
inline constexpr Weights kVolumeWeights{0.5, 0.5, 0.0};
/// Weights for rounder triangles, at a larger distance to the input.
inline constexpr Weights kShapeWeights{0.4, 0.3, 0.3};

/// Method, lengths and bounds of a simplification. Lengths are in the mesh's own unit. simplify() replaces
/// absent values by the "auto" ones, see resolve(). The functions of a single method, such as
/// simplify_regions(), take an absent length as 0 and an absent bound as none.
struct Options {
    Method method = Method::region_bounded;
    /// Edges shorter than this collapse everywhere, features included; 0 leaves features untouched. auto: the
    /// base length. Region methods only.
    std::optional<double> l0{};
    /// Growth of the allowed length per ring of neighbours away from features; at most l0 keeps triangles
    /// well shaped. auto: the base length. Region methods only.
    std::optional<double> step{};
    /// No edge longer than this collapses; ends the schedule of regions unless there is a target. auto: 3
    /// base lengths, but at least l0 + step; for Lindstrom-Turk 2 base lengths, or none if there is a target.
    std::optional<double> l_max{};
    /// Stops as soon as no more than this many vertices are left. The region methods then ignore l_max and
    /// relax the allowed lengths until the target is met.
    std::optional<std::size_t> target_vertices{};
    std::optional<Weights> weights{};  ///< auto: kVolumeWeights
    /// Largest distance of any vertex of the input from the result, and of any vertex of the result from the
    /// input. auto: kBoundedError base lengths for region-bounded without a target, else no bound.
    std::optional<double> max_error{};
    /// Largest edge length at each input vertex whatever its distance to features, e.g. where flux varies.
    /// Infinity means no bound at that vertex; empty means none anywhere. Only region-bounded reads it.
    std::span<const double> max_length_at{};
    /// One flag an input vertex: no edge at a flagged vertex collapses, e.g. where both sides of a periodic
    /// domain must keep the same curve. Empty for none.
    std::span<const std::uint8_t> fixed{};
    std::optional<double> grid_spacing{};  ///< dx of the level set the mesh was extracted from
    /// Called now and then with the approximate number of vertices left, from any thread, one at a time.
    std::function<void(std::size_t vertices)> progress{};
};

/// Default max_error of region-bounded, in base lengths: below a level set's resolution, above its roughness.
inline constexpr double kBoundedError = 0.05;

/// The unit of "auto" lengths: the grid spacing if there is one, else the mean length of edges between
/// features (Lenz 2023, section 8.2.2) or, if there are none, of all edges; 0 without triangles.
/// \throws GeometryError on a damaged mesh or if \p features is not one flag a vertex; RecipeError on the
///         spacing.
double base_length(const TriangleMesh& mesh, std::span<const std::uint8_t> features,
                   std::optional<double> grid_spacing);

/// Fills in the lengths and the error bound that are absent ("auto"). \p base is the base length.
Options resolve(Options options, double base);

/// Refuses lengths, weights and targets out of range.
/// \param regions  whether the method is a region method, which needs `step`.
/// \throws RecipeError naming the key, the value and its range.
void check(const Options& options, bool regions);

}  // namespace sidewall::simplify
