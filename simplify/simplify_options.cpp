#include "simplify/simplify_options.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <utility>

#include "simplify/collapse_mesh.hpp"
#include "surface/error.hpp"

namespace sidewall::simplify {
namespace {

constexpr std::array<std::pair<Method, std::string_view>, 5> kMethods{
    {{Method::none, "none"},
     {Method::lindstrom_turk, "lindstrom-turk"},
     {Method::region, "region"},
     {Method::cgal_lindstrom_turk, "cgal-lindstrom-turk"},
     {Method::region_bounded, "region-bounded"}}};

// "auto" l_max of the region methods, in base lengths. 2, 3, 5 remove 97.2, 98.3, 98.7 % of the vertices
// (simplify_bench), but longer edges than 3 double the distance to the input, and flux varies along them.
constexpr double kRegionLengths = 3.0;
// "auto" l_max of Lindstrom-Turk, in base lengths: shorter, because this method does not protect features.
constexpr double kLindstromTurkLengths = 2.0;

void check_length(std::string_view key, double value, bool zero_allowed, bool infinite_allowed) {
    const bool low = zero_allowed ? value >= 0.0 : value > 0.0;
    if (!low || (!infinite_allowed && std::isinf(value)))
        throw RecipeError("simplify.{} = {}: must be a {} length in the mesh's unit", key, value,
                          zero_allowed ? "non-negative" : "positive");
}

void check_weights(const Weights& weights) {
    for (const auto& [key, value] :
         {std::pair{"volume", weights.volume}, {"boundary", weights.boundary}, {"shape", weights.shape}})
        if (!(value >= 0.0) || std::isinf(value))
            throw RecipeError("simplify.weights: {} = {}: must be finite and not negative", key, value);
    if (weights.volume + weights.shape <= 0.0)
        throw RecipeError(
            "simplify.weights: volume and shape are both 0, which leaves edges off the boundary without a "
            "cost; make one of them positive");
}

}  // namespace

std::string_view to_string(Method method) {
    for (const auto& [known, name] : kMethods)
        if (known == method) return name;
    return "unknown";
}

bool reads_features(Method method) {
    return method == Method::region || method == Method::region_bounded;
}

Method method_from_string(std::string_view name) {
    std::string names;
    for (const auto& [method, known] : kMethods) {
        if (known == name) return method;
        names += fmt::format("{}{}", names.empty() ? "" : ", ", known);
    }
    throw RecipeError("simplify.method = \"{}\": must be one of {}", name, names);
}

double base_length(const TriangleMesh& mesh, std::span<const std::uint8_t> features,
                   std::optional<double> grid_spacing) {
    if (grid_spacing) {
        check_length("grid_spacing", *grid_spacing, false, false);
        return *grid_spacing;
    }
    if (!features.empty() && features.size() != mesh.vertices.size())
        throw GeometryError("{} feature flags for {} vertices: give one a vertex", features.size(),
                            mesh.vertices.size());
    check_arrays(mesh);
    double feature_sum = 0.0, sum = 0.0;
    std::size_t feature_edges = 0;
    for (const Triangle& t : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t a = t[k], b = t[(k + 1) % 3];
            const double length = (mesh.vertices[a] - mesh.vertices[b]).norm();
            sum += length;
            if (features.empty() || !features[a] || !features[b]) continue;
            feature_sum += length;
            ++feature_edges;
        }
    if (feature_edges > 0) return feature_sum / static_cast<double>(feature_edges);
    return mesh.triangles.empty() ? 0.0 : sum / (3.0 * static_cast<double>(mesh.triangles.size()));
}

Options resolve(Options options, double base) {
    if (reads_features(options.method)) {
        if (!options.l0) options.l0 = base;
        if (!options.step) options.step = base;
        if (!options.l_max) options.l_max = std::max(kRegionLengths * base, *options.l0 + *options.step);
        if (!options.max_error && !options.target_vertices && options.method == Method::region_bounded)
            options.max_error = kBoundedError * base;
    } else if (!options.l_max && !options.target_vertices) {
        options.l_max = kLindstromTurkLengths * base;
    }
    return options;
}

void check(const Options& options, bool regions) {
    if (regions) {
        check_length("l0", options.l0.value_or(0.0), true, false);
        check_length("step", options.step.value_or(0.0), false, false);
    }
    check_length("l_max", options.l_max.value_or(kInfinity), true, true);
    check_length("max_error", options.max_error.value_or(kInfinity), false, true);
    if (options.weights) check_weights(*options.weights);
    if (options.target_vertices == 0u) throw RecipeError("simplify.target_vertices = 0: must be at least 1");
}

}  // namespace sidewall::simplify
