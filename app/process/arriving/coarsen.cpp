#include "app/process/arriving/coarsen.hpp"

#include "app/process/arriving/flux_gradient.hpp"
#include "levelset/meshes/grid_curvature.hpp"
#include "simplify/simplify.hpp"
#include "surface/curvature.hpp"

namespace sidewall::app {
namespace {

simplify::Options simplify_options(const SimplifySection& section, double spacing) {
    simplify::Options options;
    options.method = simplify::method_from_string(section.method);
    options.l0 = section.l0;
    options.step = section.step;
    options.l_max = section.l_max;
    options.max_error = section.max_error;
    options.grid_spacing = spacing;
    if (section.target_vertices > 0)
        options.target_vertices = static_cast<std::size_t>(section.target_vertices);
    if (!section.weights.empty())
        options.weights = simplify::Weights{section.weights[0], section.weights[1], section.weights[2]};
    return options;
}

// A particle that leaves through a periodic side must find the same surface on the opposite one. Those in a
// strip of one cell leave through none across y.
std::vector<std::uint8_t> on_periodic_sides(const levelset::Domain& domain, const TriangleMesh& raw) {
    const bool crossed = domain.cells[1] > 1;
    std::vector<std::uint8_t> flags(raw.vertices.size(), 0);
    for (std::size_t v = 0; v < raw.vertices.size(); ++v)
        for (int axis = 0; axis < (crossed ? 2 : 1); ++axis) {
            const auto a = static_cast<std::size_t>(axis);
            const double x = raw.vertices[v][axis];
            if (domain.side[a] == levelset::Side::periodic && (x == domain.min[a] || x == domain.max[a]))
                flags[v] = 1;
        }
    return flags;
}

// The strip between the line of \p mesh on the side of least y and its copy on the opposite one: whatever is
// the same at all y is an unknown of radiosity once.
TriangleMesh extruded_side(const TriangleMesh& mesh, const levelset::Domain& domain) {
    constexpr std::uint32_t kNone = 0xffffffffu;
    TriangleMesh strip;
    std::vector<std::uint32_t> copy(mesh.vertices.size(), kNone);
    const auto vertex = [&](std::uint32_t v) {
        if (copy[v] != kNone) return copy[v];
        copy[v] = static_cast<std::uint32_t>(strip.vertices.size());
        const Vec3& p = mesh.vertices[v];
        strip.vertices.push_back(p);
        strip.vertices.emplace_back(p.x(), domain.max[1], p.z());
        return copy[v];
    };
    for (const auto& triangle : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t from = triangle[k], to = triangle[(k + 1) % 3];
            if (mesh.vertices[from].y() != domain.min[1] || mesh.vertices[to].y() != domain.min[1]) continue;
            const std::uint32_t a = vertex(from), b = vertex(to);
            strip.triangles.push_back({a, b, b + 1});
            strip.triangles.push_back({a, b + 1, a + 1});
        }
    return strip;
}

}  // namespace

bool bounds_by_flux(const SimplifySection& section) {
    return section.flux_change > 0.0 && section.method == "region-bounded";
}

TriangleMesh coarsen(const Recipe& recipe, const levelset::MaterialStack& stack, const TriangleMesh& raw,
                     const SurfaceField& carried, Timing& timing) {
    const double spacing = stack.domain.spacing;
    simplify::Options options = simplify_options(recipe.simplify, spacing);
    std::vector<std::uint8_t> features;
    if (options.method == simplify::Method::region || options.method == simplify::Method::region_bounded) {
        const PhaseClock clock(timing.features);
        // Vertices where levels meet lie on no edge of a grid.
        const surface::Curvature curvature = stack.coarser
                                                 ? surface::mesh_curvature(raw)
                                                 : levelset::curvature(stack.top(), stack.domain, raw);
        const double parameter = recipe.simplify.feature_parameter.value_or(
            surface::auto_feature_parameter(curvature.mean, curvature.gaussian, spacing));
        features = surface::feature_flags(curvature, spacing, parameter);
    }
    const PhaseClock clock(timing.simplify);
    std::vector<double> lengths;
    if (bounds_by_flux(recipe.simplify)) {
        lengths = resolving_lengths(carried, raw, recipe.simplify.flux_change, spacing);
        options.max_length_at = lengths;
    }
    const std::vector<std::uint8_t> fixed = on_periodic_sides(stack.domain, raw);
    options.fixed = fixed;
    TriangleMesh mesh = simplify::simplify(raw, features, options).mesh;
    const bool strip = stack.domain.cells[1] == 1 && stack.domain.side[1] == levelset::Side::periodic;
    return strip && recipe.flux.method != "monte-carlo" ? extruded_side(mesh, stack.domain) : mesh;
}

}  // namespace sidewall::app
