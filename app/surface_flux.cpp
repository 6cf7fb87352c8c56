#include "app/surface_flux.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "flux/smoothing.hpp"
#include "levelset/curvature.hpp"
#include "levelset/extract.hpp"
#include "simplify/simplify.hpp"
#include "surface/curvature.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

// More leaks than these mean a torn surface; single ones are rounding where two sheets touch.
constexpr double kTolerableLeakage = 1e-5;  // share of the rays
constexpr double kTolerableLeaks = 10.0;

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

// A particle that leaves through a periodic side must find the same surface on the opposite one.
TriangleMesh with_fixed_sides(const levelset::Domain& domain, const TriangleMesh& raw) {
    TriangleMesh mesh = raw;
    Attribute fixed{"fixed", 1, Scalar::int32, std::vector<double>(raw.vertices.size(), 0.0)};
    for (std::size_t v = 0; v < raw.vertices.size(); ++v)
        for (int axis = 0; axis < 2; ++axis) {
            const auto a = static_cast<std::size_t>(axis);
            const double x = raw.vertices[v][axis];
            if (domain.side[a] == levelset::Side::periodic && (x == domain.min[a] || x == domain.max[a]))
                fixed.values[v] = 1.0;
        }
    mesh.vertex_attributes.push_back(std::move(fixed));
    return mesh;
}

TriangleMesh reduce(const Recipe& recipe, const levelset::MaterialStack& stack, const TriangleMesh& raw,
                    Timing& timing) {
    const double spacing = stack.domain.spacing;
    const simplify::Options options = simplify_options(recipe.simplify, spacing);
    std::vector<std::uint8_t> features;
    if (options.method == simplify::Method::region || options.method == simplify::Method::region_bounded) {
        const PhaseClock clock(timing.features);
        const levelset::Curvature curvature = levelset::curvature(stack.top(), stack.domain, raw);
        const double parameter = recipe.simplify.feature_parameter.value_or(
            surface::auto_feature_parameter(curvature.mean, curvature.gaussian, spacing));
        features = levelset::feature_flags(curvature, spacing, parameter);
    }
    const PhaseClock clock(timing.simplify);
    return simplify::simplify(with_fixed_sides(stack.domain, raw), features, options).mesh;
}

std::vector<std::int32_t> materials_of(const levelset::MaterialStack& stack, const TriangleMesh& mesh) {
    std::vector<std::int32_t> materials(mesh.triangles.size());
    tbb::parallel_for(std::size_t{0}, materials.size(), [&](std::size_t t) {
        materials[t] = levelset::exposed_material(stack, triangle_centroid(mesh, t));
    });
    return materials;
}

flux::LateralBox lateral_box(const levelset::Domain& domain) {
    flux::LateralBox box{domain.min, domain.max, {}};
    for (std::size_t a = 0; a < 2; ++a)
        box.boundary[a] = domain.side[a] == levelset::Side::periodic ? flux::Boundary::periodic
                                                                     : flux::Boundary::reflective;
    return box;
}

}  // namespace

SurfaceFlux trace_surface(const Recipe& recipe, const Model& model, const levelset::MaterialStack& stack,
                          std::uint32_t time_step, Timing& timing,
                          const std::function<void(double)>& progress) {
    SurfaceFlux surface;
    surface.box = lateral_box(stack.domain);
    {
        const PhaseClock clock(timing.extract);
        surface.raw = levelset::extract_surface(stack.top(), stack.domain);
        if (surface.raw.triangles.empty())
            throw NumericsError(
                "the surface has vanished: no material boundary is left in the domain; shorten the step");
    }
    if (!model.species.empty() && recipe.simplify.method != "none")
        surface.simplified = reduce(recipe, stack, surface.raw, timing);
    if (model.species.empty() && !model.visibility) return surface;
    {
        const PhaseClock clock(timing.bvh);
        surface.scene.emplace(surface.traced());
    }
    if (model.species.empty()) return surface;
    const PhaseClock clock(timing.trace);
    surface.materials = materials_of(stack, surface.traced());
    surface.wedges = flux::make_wedges(surface.traced(), surface.materials);
    for (std::uint32_t k = 0; k < model.species.size(); ++k) {
        flux::TraceOptions options;
        options.rays = static_cast<std::uint64_t>(recipe.flux.rays);
        options.seed = static_cast<std::uint64_t>(recipe.flux.seed);
        options.step = time_step;
        options.species_index = k;
        options.progress = progress;
        surface.fluxes.push_back(flux::trace_flux(surface.traced(), *surface.scene, surface.box,
                                                  model.species[k], surface.materials, surface.wedges,
                                                  options));
        const auto& result = surface.fluxes.back();
        surface.wedge_flux.push_back(flux::smoothed_flux(surface.traced(), surface.wedges, result.wedge));
        if (static_cast<double>(result.leaked) >
            kTolerableLeaks + kTolerableLeakage * static_cast<double>(result.emitted))
            throw NumericsError(
                fmt::format("species {}: {} of {} particles leaked through the surface; use a smaller "
                            "grid_spacing or a milder simplification",
                            model.species[k].name, result.leaked, result.emitted));
    }
    return surface;
}

bool visible(const SurfaceFlux& surface, const Vec3& point, const Vec3& normal, const Vec3& direction,
             double spacing) {
    Vec3 position = point + 1e-2 * spacing * (normal + direction), path = direction;
    if (surface.box.boundary[0] != flux::Boundary::open)
        for (int axis = 0; axis < 2; ++axis) {
            const auto a = static_cast<std::size_t>(axis);
            position[axis] = std::clamp(position[axis], surface.box.min[a], surface.box.max[a]);
        }
    // A path this flat crosses more sides than any wafer is wide.
    constexpr int kMostSides = 10000;
    for (int sides = 0; sides < kMostSides; ++sides) {
        const flux::SideMeeting side = flux::next_side(surface.box, position, path);
        if (surface.scene->occluded(position, path, 0.0, side.distance)) return false;
        if (!std::isfinite(side.distance)) return true;
        const bool above = position.z() + side.distance * path.z() > surface.scene->top();
        if (above || !flux::cross_side(surface.box, side, position, path)) return true;
    }
    return false;
}

levelset::Motion surface_motion(const Model& model, const levelset::MaterialStack& stack,
                                const SurfaceFlux& surface, Timing& timing) {
    levelset::Extension extension;
    {
        const PhaseClock clock(timing.extend);
        extension = surface.scene ? levelset::extend(stack.top(), stack.domain, *surface.scene)
                                  : levelset::extend_without_mesh(stack.top(), stack.domain);
    }
    const PhaseClock clock(timing.rates);
    const std::size_t species = model.species.size(), count = extension.samples.size();
    std::vector<double> flux(count * species);
    std::vector<std::uint8_t> seen(model.visibility ? count : 0);
    const std::vector<Vec3> normals =
        model.visibility ? triangle_normals(surface.traced()) : std::vector<Vec3>{};
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 256), [&](const auto& range) {
        for (std::size_t n = range.begin(); n != range.end(); ++n) {
            const levelset::SurfaceSample& s = extension.samples[n];
            const auto u = static_cast<double>(s.u), v = static_cast<double>(s.v);
            for (std::size_t k = 0; k < species; ++k)
                flux[n * species + k] =
                    flux::interpolate(surface.wedges, surface.wedge_flux[k], s.triangle, u, v);
            if (!model.visibility) continue;
            const auto [a, b, c] = surface.traced().triangles[s.triangle];
            const auto& x = surface.traced().vertices;
            const Vec3 point = (1.0 - u - v) * x[a] + u * x[b] + v * x[c];
            seen[n] = visible(surface, point, normals[s.triangle], *model.visibility, stack.domain.spacing);
        }
    });
    auto speed = [&stack, speed_of = model.speed, species, flux = std::move(flux), seen = std::move(seen)](
                     std::size_t sample, std::size_t layer, const Vec3& normal) {
        const SurfacePoint point{stack.layers[layer].material,
                                 std::span(flux).subspan(sample * species, species), normal,
                                 seen.empty() || seen[sample] != 0};
        return speed_of(point);
    };
    return levelset::make_motion(stack, std::move(extension), std::move(speed), model.depends_on_normal);
}

}  // namespace sidewall::app
