#include "app/process/arriving/traced_mesh.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "app/recipe/recipe_domain.hpp"
#include "levelset/meshes/extract.hpp"
#include "levelset/meshes/grid_curvature.hpp"
#include "levelset/meshes/volume.hpp"
#include "simplify/simplify.hpp"
#include "surface/curvature.hpp"

namespace sidewall::app {
namespace {

simplify::Options simplify_options(const SimplifySection& section, double spacing) {
    simplify::Options options;
    options.method = section.method == "auto" ? simplify::Method::region_bounded
                                              : simplify::method_from_string(section.method);
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

// Marks the vertices on periodic sides. In a profile one cell thick no particle leaves across y.
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

// Also marks the vertices on sharp edges of an extracted surface.
void mark_sharp_edges(const TriangleMesh& raw, std::vector<std::uint8_t>& flags) {
    if (const Attribute* edge = raw.vertex_attribute(levelset::kEdgeAttribute))
        for (std::size_t v = 0; v < flags.size(); ++v) flags[v] |= edge->values[v] != 0.0;
}

// The outline on the side of least y, extruded to the opposite side: one radiosity unknown serves all y.
TriangleMesh extruded_side(const TriangleMesh& mesh, const levelset::Domain& domain) {
    constexpr std::uint32_t kNone = 0xffffffffu;
    TriangleMesh extruded;
    std::vector<std::uint32_t> copy(mesh.vertices.size(), kNone);
    const auto vertex = [&](std::uint32_t v) {
        if (copy[v] != kNone) return copy[v];
        copy[v] = static_cast<std::uint32_t>(extruded.vertices.size());
        const Vec3& p = mesh.vertices[v];
        extruded.vertices.push_back(p);
        extruded.vertices.emplace_back(p.x(), domain.max[1], p.z());
        return copy[v];
    };
    using Edge = std::pair<std::uint32_t, std::uint32_t>;
    std::vector<Edge> on_side;  // ordered by triangle
    for (const auto& triangle : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t from = triangle[k], to = triangle[(k + 1) % 3];
            if (mesh.vertices[from].y() == domain.min[1] && mesh.vertices[to].y() == domain.min[1])
                on_side.emplace_back(from, to);
        }
    // A triangle that closes a corner may lie in the side: edges that run both ways are no part of the
    // outline.
    std::vector<Edge> sorted = on_side;
    std::sort(sorted.begin(), sorted.end());
    for (const auto& [from, to] : on_side)
        if (!std::binary_search(sorted.begin(), sorted.end(), Edge(to, from))) {
            const std::uint32_t a = vertex(from), b = vertex(to);
            extruded.triangles.push_back({a, b, b + 1});
            extruded.triangles.push_back({a, b + 1, a + 1});
        }
    for (const Attribute& attribute : mesh.vertex_attributes) {
        Attribute& values = extruded.vertex_attributes.emplace_back(attribute);
        values.values.resize(extruded.vertices.size());
        for (std::size_t v = 0; v < copy.size(); ++v)
            if (copy[v] != kNone) values.values[copy[v]] = values.values[copy[v] + 1] = attribute.values[v];
    }
    return extruded;
}

flux::LateralBox lateral_box(const levelset::Domain& domain) {
    flux::LateralBox box{domain.min, domain.max, {}};
    box.axial = domain.axial;
    box.period = domain.period();
    for (std::size_t a = 0; a < 2; ++a)
        box.boundary[a] = domain.side[a] == levelset::Side::periodic ? flux::Boundary::periodic
                                                                     : flux::Boundary::reflective;
    return box;
}

std::vector<std::uint8_t> features_of(const Recipe& recipe, const levelset::MaterialStack& stack,
                                      const TriangleMesh& raw) {
    const double spacing = stack.domain.spacing;
    // Between grid levels, vertices lie on no grid edge: the mesh's curvature is used then.
    const surface::Curvature curvature =
        stack.coarser ? surface::mesh_curvature(raw) : levelset::curvature(stack.top(), stack.domain, raw);
    const double parameter = recipe.simplify.feature_parameter.value_or(
        surface::auto_feature_parameter(curvature.mean, curvature.gaussian, spacing));
    std::vector<std::uint8_t> flags = surface::feature_flags(curvature, spacing, parameter);
    mark_sharp_edges(raw, flags);
    return flags;
}

// Whether all species are neutrals that are mostly re-emitted rather than stick, so that fluxes are smooth.
bool spreads_evenly(const Model& model) {
    return std::ranges::all_of(model.species, [](const flux::Species& species) {
        return flux::only_reemits_diffusely(species) && std::ranges::max(species.sticking) <= 0.5;
    });
}

}  // namespace

bool is_profile(const levelset::Domain& domain) {
    return domain.cells[1] == 1 && domain.side[1] == levelset::Side::periodic;
}

TracedSurface extract(const levelset::MaterialStack& stack, double time, Timing& timing,
                      surface::SharpEdges edges) {
    const PhaseClock clock(timing.extract);
    TracedSurface surface;
    surface.time = time;
    surface.box = lateral_box(stack.domain);
    surface.raw = levelset::extract_surface(stack, edges);
    if (is_profile(stack.domain)) surface.raw = extruded_side(surface.raw, stack.domain);
    if (surface.raw.triangles.empty())
        throw NumericsError(
            "the surface has vanished: no material boundary is left in the domain; shorten the step");
    surface.pieces = levelset::surface_pieces(surface.raw, stack);
    return surface;
}

bool coarsens(const Recipe& recipe, const Model& model, std::size_t triangles, std::optional<double> noise) {
    if (recipe.simplify.method != "auto") return recipe.simplify.method != "none";
    // Longer elements flatten fluxes that vary over few cells: etched holes became 1 to 7 % less deep,
    // whatever the number of rays. A profile has few elements anyway.
    if (is_flat(recipe.domain) || !spreads_evenly(model)) return false;
    const auto n = static_cast<double>(triangles);
    // On the extracted surface, (relative error)^2 is about this times triangles over rays. A trace to a
    // relative error begins with at least flux::first_round rays.
    constexpr double kErrorOfRay = 0.12;
    if (const auto target = noise ? noise : recipe.flux.relative_error)
        return kErrorOfRay * n / (*target * *target) > static_cast<double>(flux::first_round(triangles));
    // For an equal error a coarsened mesh needs at most a quarter of the rays, which saves about 0.5
    // microseconds a ray; coarsening takes 4 microseconds a triangle.
    constexpr double kRaysOfTriangle = 8.0;
    const auto passes = static_cast<double>(flux::passes_of(model.species).size());
    return passes * static_cast<double>(recipe.flux.most_rays()) > kRaysOfTriangle * n;
}

void simplify(const Recipe& recipe, const Model& model, const levelset::MaterialStack& stack,
              const SurfaceField& carried, std::optional<double> noise, TracedSurface& surface,
              Timing& timing) {
    if (model.species.empty() || !coarsens(recipe, model, surface.raw.triangles.size(), noise)) return;
    const double spacing = stack.domain.spacing;
    simplify::Options options = simplify_options(recipe.simplify, spacing);
    std::vector<std::uint8_t> features;
    if (simplify::reads_features(options.method)) {
        const PhaseClock clock(timing.features);
        features = features_of(recipe, stack, surface.raw);
    }
    const PhaseClock clock(timing.simplify);
    std::vector<double> lengths;
    if (bounds_by_flux(recipe.simplify)) {
        lengths = resolving_lengths(carried, surface.raw, surface.box, recipe.simplify.flux_change, spacing);
        options.max_length_at = lengths;
    }
    std::vector<std::uint8_t> fixed = on_periodic_sides(stack.domain, surface.raw);
    mark_sharp_edges(surface.raw, fixed);  // long chords would narrow round rims
    options.fixed = fixed;
    TriangleMesh mesh = simplify::simplify(surface.raw, features, options).mesh;
    surface.simplified = is_profile(stack.domain) ? extruded_side(mesh, stack.domain) : std::move(mesh);
}

std::vector<double> resolving_lengths(const SurfaceField& carried, const TriangleMesh& mesh,
                                      const flux::LateralBox& box, double change, double spacing) {
    std::vector<double> lengths = carry(carried, {kFluxGradient}, mesh.vertices, box).front();
    for (double& length : lengths) length = length > 0.0 ? std::max(spacing, change / length) : kInfinity;
    return lengths;
}

}  // namespace sidewall::app
