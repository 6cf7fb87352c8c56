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
    none,                 ///< the mesh as it is
    lindstrom_turk,       ///< the same rule everywhere
    region,               ///< features kept fine, flat parts coarsened ring by ring
    cgal_lindstrom_turk,  ///< Lindstrom-Turk on CGAL's edge collapse, whatever the default engine is
    region_bounded        ///< regions by length and by a bound on the distance to the input
};

std::string_view to_string(Method method);

/// Whether the method is one of the region methods, which read features.
bool reads_features(Method method);

/// \throws RecipeError naming the known methods.
Method method_from_string(std::string_view name);

/// How much each term of Lindstrom and Turk's cost counts. Their ratios matter, not their sum.
struct Weights {
    double volume = 0.5;    ///< squared volume swept by the moved triangles
    double boundary = 0.5;  ///< squared area swept by the moved boundary edges
    double shape = 0.0;     ///< squared distances to the neighbours: larger makes triangles more equilateral
};

/// CGAL's default, and that of every method here: nearest to the surface (tests/bench/simplify_bench.cpp).
inline constexpr Weights kVolumeWeights{0.5, 0.5, 0.0};
/// Rounder triangles at a larger distance.
inline constexpr Weights kShapeWeights{0.4, 0.3, 0.3};

/// What a method keeps to. Lengths are in the mesh's own unit. simplify() fills in by resolve() what is absent; to
/// the functions of a single method, an absent length is 0 and an absent bound none.
struct Options {
    Method method = Method::region_bounded;
    /// Edges shorter than this collapse everywhere, features included; 0 leaves features untouched. auto: the
    /// base length. Region methods only.
    std::optional<double> l0{};
    /// Growth of that length per ring of neighbours away from features; at most l0 keeps triangles well
    /// shaped. auto: the base length. Region methods only.
    std::optional<double> step{};
    /// No longer edge collapses; ends the schedule of regions unless there is a target. auto: 3 base lengths;
    /// Lindstrom-Turk 2, or none if there is a target.
    std::optional<double> l_max{};
    /// Stops as soon as no more than this many vertices are left. For the region methods, l_max then bounds
    /// nothing, and lengths are relaxed where they stand in the way.
    std::optional<std::size_t> target_vertices{};
    std::optional<Weights> weights{};  ///< auto: kVolumeWeights
    /// No vertex of the input comes to lie farther from the result than this, nor one of the result farther
    /// from the input. auto: region-bounded kBoundedError base lengths where there is no target, the others none.
    std::optional<double> max_error{};
    /// Edge length allowed at each input vertex whatever its distance to features, e.g. where flux varies;
    /// infinity for no bound, empty for none at all. Only region-bounded reads it.
    std::span<const double> max_length_at{};
    /// One flag an input vertex: no collapse touches those set, e.g. where a periodic side must keep the
    /// curve of the opposite one. Empty for none.
    std::span<const std::uint8_t> fixed{};
    std::optional<double> grid_spacing{};  ///< dx of the level set the mesh was extracted from
    /// Called now and then with about how many vertices are left, one call at a time, from any thread.
    std::function<void(std::size_t vertices)> progress{};
};

/// Error bound of region-bounded, in base lengths, where nothing else is said: well below what a level set on
/// that grid resolves, yet beyond its roughness.
inline constexpr double kBoundedError = 0.05;

/// The length that "auto" stands for: the grid spacing if there is one, else the mean length of the edges
/// between features (Lenz 2023, section 8.2.2), or of all edges if there are none; 0 for a mesh without
/// triangles.
/// \throws GeometryError on a damaged mesh or flags of another length, RecipeError on the spacing.
double base_length(const TriangleMesh& mesh, std::span<const std::uint8_t> features,
                   std::optional<double> grid_spacing);

/// Fills in the lengths and the bound that are "auto" for the method. \p base is the base length.
Options resolve(Options options, double base);

/// Refuses lengths, weights and targets out of range.
/// \param regions  for a region method, which needs `step`.
/// \throws RecipeError naming the key, the value and its range.
void check(const Options& options, bool regions);

}  // namespace sidewall::simplify
