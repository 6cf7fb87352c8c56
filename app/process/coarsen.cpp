#include "app/process/coarsen.hpp"

#include "app/process/flux_gradient.hpp"
#include "levelset/curvature.hpp"
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

// A particle that leaves through a periodic side must find the same surface on the opposite one. Those that
// are traced in a strip of one cell leave through none across y.
std::vector<std::uint8_t> on_periodic_sides(const Recipe& recipe, const levelset::Domain& domain,
                                            const TriangleMesh& raw) {
    const bool crossed = domain.cells[1] > 1 || recipe.flux.method != "monte-carlo";
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
        const surface::Curvature curvature = levelset::curvature(stack.top(), stack.domain, raw);
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
    const std::vector<std::uint8_t> fixed = on_periodic_sides(recipe, stack.domain, raw);
    options.fixed = fixed;
    return simplify::simplify(raw, features, options).mesh;
}

}  // namespace sidewall::app
