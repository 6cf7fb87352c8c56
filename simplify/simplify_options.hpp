#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
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

/// \throws RecipeError naming the known methods.
Method method_from_string(std::string_view name);

/// Called now and then with about how many vertices are left, one call at a time, from any thread.
using Progress = std::function<void(std::size_t vertices)>;

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

/// Plain Lindstrom-Turk. Lengths are in the mesh's own unit.
struct LindstromTurkOptions {
    std::optional<std::size_t> target_vertices{};  ///< stops as soon as no more than this many are left
    double max_edge_length = std::numeric_limits<double>::infinity();  ///< only shorter edges collapse
    Weights weights = kVolumeWeights;
    /// No vertex of the input comes to lie farther from the result than this, nor one of the result farther
    /// from the input.
    double max_error = std::numeric_limits<double>::infinity();
    /// One flag an input vertex: no collapse touches those set, e.g. where a periodic side must keep the
    /// curve of the opposite one. Empty for none.
    std::span<const std::uint8_t> fixed{};
    Progress progress{};
};

/// How a region simplification grades the mesh. Lengths are in the mesh's own unit.
struct RegionOptions {
    /// Edges shorter than this collapse everywhere, features included; 0 leaves features untouched.
    double l0 = 0.0;
    /// Growth of that length per ring of neighbours away from features; at most l0 keeps triangles well
    /// shaped.
    double step = 0.0;
    double l_max = 0.0;  ///< no longer edge is collapsed; ends the schedule unless there is a target
    /// Stops the schedule as soon as no more than this many vertices are left. l_max no longer ends it, and
    /// where its passes end short of the target, they start again with l0 and step a quarter longer (l0 = 0
    /// stays 0).
    std::optional<std::size_t> target_vertices{};
    Weights weights = kVolumeWeights;
    double max_error = std::numeric_limits<double>::infinity();  ///< as in LindstromTurkOptions
    /// Edge length allowed at each input vertex whatever its distance to features, e.g. where flux varies;
    /// infinity for no bound, empty for none at all. Only region-bounded reads it.
    std::span<const double> max_length_at{};
    std::span<const std::uint8_t> fixed{};  ///< as in LindstromTurkOptions
    Progress progress{};
};

/// Options of a recipe or command line; what is absent is "auto". Lengths are in the mesh's own unit.
struct Options {
    Method method = Method::region_bounded;
    std::optional<double> l0{};    ///< auto: the base length
    std::optional<double> step{};  ///< auto: the base length
    /// auto: 3 base lengths; Lindstrom-Turk 2, or none if there is a target
    std::optional<double> l_max{};
    std::optional<std::size_t> target_vertices{};
    std::optional<Weights> weights{};
    /// Hard bound on the distance, both ways, at the vertices. auto: region-bounded kBoundedError base
    /// lengths where there is no target, the others none
    std::optional<double> max_error{};
    std::span<const double> max_length_at{};  ///< as in RegionOptions; region-bounded only
    std::span<const std::uint8_t> fixed{};    ///< as in LindstromTurkOptions
    std::optional<double> grid_spacing{};     ///< dx of the level set the mesh was extracted from
    Progress progress{};
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

/// Fills in what is "auto".
/// \throws RecipeError on a length or weight out of range.
RegionOptions resolve_region(const Options& options, double base);
LindstromTurkOptions resolve_lindstrom_turk(const Options& options, double base);

/// \throws RecipeError naming the key, the value and its range.
void check(const RegionOptions& options);
void check(const LindstromTurkOptions& options);

}  // namespace sidewall::simplify
