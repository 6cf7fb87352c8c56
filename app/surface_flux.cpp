#include "app/surface_flux.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <cmath>

#include "app/flux_gradient.hpp"
#include "app/flux_reuse.hpp"
#include "app/species_flux.hpp"
#include "levelset/curvature.hpp"
#include "levelset/extract.hpp"
#include "levelset/voids.hpp"
#include "simplify/simplify.hpp"
#include "surface/curvature.hpp"
#include "surface/error.hpp"

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

bool bounds_by_flux(const SimplifySection& section) {
    return section.flux_change > 0.0 && section.method == "region-bounded";
}

// A particle that leaves through a periodic side must find the same surface on the opposite one.
std::vector<std::uint8_t> on_periodic_sides(const levelset::Domain& domain, const TriangleMesh& raw) {
    std::vector<std::uint8_t> flags(raw.vertices.size(), 0);
    for (std::size_t v = 0; v < raw.vertices.size(); ++v)
        for (int axis = 0; axis < 2; ++axis) {
            const auto a = static_cast<std::size_t>(axis);
            const double x = raw.vertices[v][axis];
            if (domain.side[a] == levelset::Side::periodic && (x == domain.min[a] || x == domain.max[a]))
                flags[v] = 1;
        }
    return flags;
}

TriangleMesh reduce(const Recipe& recipe, const levelset::MaterialStack& stack, const TriangleMesh& raw,
                    const CoverageField& carried, Timing& timing) {
    const double spacing = stack.domain.spacing;
    simplify::Options options = simplify_options(recipe.simplify, spacing);
    std::vector<std::uint8_t> features;
    if (options.method == simplify::Method::region || options.method == simplify::Method::region_bounded) {
        const PhaseClock clock(timing.features);
        const levelset::Curvature curvature = levelset::curvature(stack.top(), stack.domain, raw);
        const double parameter = recipe.simplify.feature_parameter.value_or(
            surface::auto_feature_parameter(curvature.mean, curvature.gaussian, spacing));
        features = levelset::feature_flags(curvature, spacing, parameter);
    }
    const PhaseClock clock(timing.simplify);
    std::vector<double> lengths;
    if (bounds_by_flux(recipe.simplify)) {
        lengths = resolving_lengths(carried, raw, recipe.simplify.flux_change, spacing);
        options.max_length_at = lengths;
    }
    const std::vector<std::uint8_t> fixed = on_periodic_sides(stack.domain, raw);
    options.fixed = fixed;
    return simplify::simplify(raw, features, options).mesh;
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

// Material of every wedge.
std::vector<std::int32_t> wedge_materials(const SurfaceFlux& surface) {
    std::vector<std::int32_t> materials(surface.wedges.count(), 0);
    for (std::size_t c = 0; c < surface.wedges.corner.size(); ++c)
        materials[surface.wedges.corner[c]] = surface.materials[c / 3];
    return materials;
}

// Calls use(wedge, point) for every wedge in parallel, with its fluxes (none before the first trace) and
// coverages.
template <class Use>
void each_wedge(const Model& model, const SurfaceFlux& surface, const std::vector<std::int32_t>& materials,
                Use&& use) {
    const std::size_t tallies = surface.wedge_flux.size(), coverages = model.coverages.names.size();
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, materials.size(), 512), [&](const auto& range) {
        std::vector<double> flux(tallies), theta(coverages);
        for (std::size_t w = range.begin(); w != range.end(); ++w) {
            for (std::size_t k = 0; k < tallies; ++k) flux[k] = surface.wedge_flux[k][w];
            for (std::size_t k = 0; k < coverages; ++k) theta[k] = surface.coverage[k][w];
            use(w, SurfacePoint{materials[w], flux, Vec3::UnitZ(), true, theta});
        }
    });
}

// Traces every species once, with the sticking that the coverages leave.
void trace_all(const Recipe& recipe, const Model& model, std::uint32_t time_step,
               const std::function<void(double)>& progress, const std::vector<std::int32_t>& materials,
               SurfaceFlux& surface) {
    std::vector<double> sticking;
    if (model.sticking) {
        sticking.resize(model.species.size() * materials.size());
        each_wedge(model, surface, materials, [&](std::size_t w, const SurfacePoint& point) {
            for (std::size_t k = 0; k < model.species.size(); ++k)
                sticking[k * materials.size() + w] = model.sticking(k, point);
        });
    }
    trace_species(recipe, model, sticking, time_step, progress, surface);
    ++surface.iterations;
}

// Coverages after `time` of the fluxes just traced. Returns the largest of their mean changes.
double react(const Model& model, double time, const std::vector<std::int32_t>& materials,
             SurfaceFlux& surface) {
    std::vector<std::vector<double>> next = surface.coverage;
    each_wedge(model, surface, materials, [&](std::size_t w, const SurfacePoint& point) {
        std::vector<double> theta(point.coverage.begin(), point.coverage.end());
        model.coverages.react(point, time, theta);
        for (std::size_t k = 0; k < theta.size(); ++k) next[k][w] = theta[k];
    });
    double most = 0.0;
    for (std::size_t k = 0; k < next.size(); ++k) {
        double change = 0.0, area = 0.0;
        for (std::size_t w = 0; w < materials.size(); ++w) {
            change += surface.wedges.area[w] * std::abs(next[k][w] - surface.coverage[k][w]);
            area += surface.wedges.area[w];
        }
        most = std::max(most, area > 0.0 ? change / area : 0.0);
    }
    surface.coverage = std::move(next);
    return most;
}

// Fluxes and coverages in turn. The random numbers stay the same, so what is left of a change is not noise.
void settle_coverages(const Recipe& recipe, const Model& model, const CoverageField& carried, bool settle,
                      std::uint32_t time_step, const std::function<void(double)>& progress,
                      SurfaceFlux& surface) {
    const std::vector<std::int32_t> materials = wedge_materials(surface);
    const auto trace = [&] { trace_all(recipe, model, time_step, progress, materials, surface); };
    const Coverages& coverages = model.coverages;
    if (coverages.names.empty()) return trace();
    if (coverages.pulse > 0.0) {
        surface.coverage.assign(coverages.names.size(), std::vector<double>(materials.size(), 0.0));
        for (int part = 0; part < coverages.parts; ++part) {
            trace();
            surface.coverage_change = react(model, coverages.pulse / coverages.parts, materials, surface);
        }
        return;
    }
    surface.coverage = carry(carried, coverages.names, surface.traced(), surface.wedges);
    do {
        trace();
        surface.coverage_change = react(model, 0.0, materials, surface);
    } while (settle && surface.coverage_change > coverages.tolerance &&
             surface.iterations < coverages.most_iterations);
}

// The stack's surface as it is now, nothing known of its fluxes.
SurfaceFlux extracted(const levelset::MaterialStack& stack, Timing& timing) {
    const PhaseClock clock(timing.extract);
    SurfaceFlux surface;
    surface.box = lateral_box(stack.domain);
    surface.raw = levelset::extract_surface(stack.top(), stack.domain);
    if (surface.raw.triangles.empty())
        throw NumericsError(
            "the surface has vanished: no material boundary is left in the domain; shorten the step");
    return surface;
}

void split_at_creases(const levelset::MaterialStack& stack, SurfaceFlux& surface) {
    surface.materials = materials_of(stack, surface.traced());
    surface.wedges = flux::make_wedges(surface.traced(), surface.materials);
}

}  // namespace

SurfaceFlux trace_surface(const Recipe& recipe, const Model& model, const levelset::MaterialStack& stack,
                          const CoverageField& carried, bool settle, std::uint32_t time_step, Timing& timing,
                          const std::function<void(double)>& progress) {
    SurfaceFlux surface = extracted(stack, timing);
    if (!model.species.empty() && recipe.simplify.method != "none")
        surface.simplified = reduce(recipe, stack, surface.raw, carried, timing);
    if (model.species.empty() && !model.visibility) return surface;
    for (;;) {
        {
            const PhaseClock clock(timing.bvh);
            surface.scene.emplace(surface.traced());
        }
        if (model.species.empty()) return surface;
        const PhaseClock clock(timing.trace);
        split_at_creases(stack, surface);
        try {
            settle_coverages(recipe, model, carried, settle, time_step, progress, surface);
            return surface;
        } catch (const Torn& torn) {
            // A fold that coarsening left among thousands of time steps must not end the run.
            if (!surface.simplified) throw;
            fmt::print(stderr, "time step {}: {}: tracing the surface as extracted instead\n", time_step,
                       torn.what());
            surface.simplified.reset();
            surface.scene.reset();
            surface.iterations = 0;
        }
    }
}

SurfaceFlux carried_surface(const Model& model, const levelset::MaterialStack& stack,
                            const CoverageField& field, Timing& timing) {
    SurfaceFlux surface = extracted(stack, timing);
    {
        const PhaseClock clock(timing.bvh);
        surface.scene.emplace(surface.raw);
    }
    const PhaseClock clock(timing.rates);
    split_at_creases(stack, surface);
    take_fluxes(model, field, surface);
    return surface;
}

CoverageField carried_field(const Recipe& recipe, const Model& model, const SurfaceFlux& surface) {
    const bool reuse = recipe.flux.reuse > 0.0;
    std::vector<std::string> names = reuse ? carried_names(model) : model.coverages.names;
    std::vector<std::vector<double>> values = reuse ? carried_values(surface) : surface.coverage;
    if (surface.simplified && bounds_by_flux(recipe.simplify)) {
        names.emplace_back(kFluxGradient);
        values.push_back(flux_gradient(surface));
    }
    return coverage_field(surface.traced(), surface.wedges, names, values);
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

void interpolate(const SurfaceFlux& surface, std::uint32_t triangle, double u, double v,
                 std::span<double> values) {
    std::size_t n = 0;
    for (const auto& flux : surface.wedge_flux)
        values[n++] = flux::interpolate(surface.wedges, flux, triangle, u, v);
    for (const auto& theta : surface.coverage)
        values[n++] = flux::interpolate(surface.wedges, theta, triangle, u, v);
}

namespace {

// The samples in closed voids, where nothing of a step without particles gets in either; empty if there are
// none.
std::vector<std::uint8_t> sealed_samples(const levelset::MaterialStack& stack, const SurfaceFlux& surface,
                                         const levelset::Extension& extension) {
    const levelset::Domain& domain = stack.domain;
    const std::vector<std::uint8_t> triangles = levelset::sealed_off(surface.raw, domain);
    std::vector<std::uint8_t> sealed;
    if (triangles.empty()) return sealed;
    sealed.resize(extension.samples.size());
    const surface::RayScene scene(surface.raw);
    tbb::parallel_for(std::size_t{0}, sealed.size(), [&](std::size_t n) {
        const levelset::SurfaceSample& s = extension.samples[n];
        const double dx = domain.spacing;
        const Vec3 foot(domain.min[0] + dx * (s.node.x() + static_cast<double>(s.foot.x())),
                        domain.min[1] + dx * (s.node.y() + static_cast<double>(s.foot.y())),
                        dx * (s.node.z() + static_cast<double>(s.foot.z())));
        if (const auto nearest = scene.closest_point(foot, dx)) sealed[n] = triangles[nearest.triangle];
    });
    return sealed;
}

}  // namespace

levelset::Motion surface_motion(const Model& model, const levelset::MaterialStack& stack,
                                const SurfaceFlux& surface, Timing& timing) {
    levelset::Extension extension;
    {
        const PhaseClock clock(timing.extend);
        extension = surface.scene ? levelset::extend(stack.top(), stack.domain, *surface.scene)
                                  : levelset::extend_without_mesh(stack.top(), stack.domain);
    }
    const PhaseClock clock(timing.rates);
    std::vector<std::uint8_t> sealed;
    if (model.species.empty()) sealed = sealed_samples(stack, surface, extension);
    const std::size_t tallies = surface.wedge_flux.size(), stride = tallies + surface.coverage.size(),
                      count = extension.samples.size();
    std::vector<double> values(count * stride);
    std::vector<std::uint8_t> seen(model.visibility ? count : 0);
    const std::vector<Vec3> normals =
        model.visibility ? triangle_normals(surface.traced()) : std::vector<Vec3>{};
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 256), [&](const auto& range) {
        for (std::size_t n = range.begin(); n != range.end(); ++n) {
            const levelset::SurfaceSample& s = extension.samples[n];
            const auto u = static_cast<double>(s.u), v = static_cast<double>(s.v);
            interpolate(surface, s.triangle, u, v, std::span(values).subspan(n * stride, stride));
            if (!model.visibility) continue;
            const auto [a, b, c] = surface.traced().triangles[s.triangle];
            const auto& x = surface.traced().vertices;
            const Vec3 point = (1.0 - u - v) * x[a] + u * x[b] + v * x[c];
            seen[n] = visible(surface, point, normals[s.triangle], *model.visibility, stack.domain.spacing);
        }
    });
    std::vector<int> materials;
    std::vector<Vec3> dissipation;
    for (const levelset::Layer& layer : stack.layers) {
        materials.push_back(layer.material);
        if (!model.dissipation.empty())
            dissipation.push_back(model.dissipation[static_cast<std::size_t>(layer.material)]);
    }
    auto speed = [materials = std::move(materials), speed_of = model.speed, tallies, stride,
                  values = std::move(values), seen = std::move(seen),
                  sealed = std::move(sealed)](std::size_t sample, std::size_t layer, const Vec3& normal) {
        if (!sealed.empty() && sealed[sample] != 0) return 0.0;
        const std::span<const double> here = std::span(values).subspan(sample * stride, stride);
        return speed_of({materials[layer], here.first(tallies), normal, seen.empty() || seen[sample] != 0,
                         here.subspan(tallies)});
    };
    levelset::Motion motion =
        levelset::make_motion(stack, std::move(extension), std::move(speed), model.depends_on_normal);
    motion.dissipation = std::move(dissipation);
    return motion;
}

}  // namespace sidewall::app
