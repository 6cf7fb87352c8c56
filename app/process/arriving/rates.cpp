#include "app/process/arriving/rates.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <boost/container/small_vector.hpp>
#include <cmath>
#include <memory>
#include <numbers>

#include "app/process/arriving/coverages.hpp"
#include "app/process/arriving/edge_faces.hpp"
#include "app/process/arriving/line_of_sight.hpp"
#include "levelset/layers/levels.hpp"
#include "levelset/meshes/pieces.hpp"
#include "levelset/motion/speed_extension.hpp"

namespace sidewall::app {
namespace {

// What the model sees at every sample of an extension.
struct SamplePoints {
    std::vector<int> materials;  // by layer
    std::size_t count = 0;
    // Values a sample: fluxes without the parts that depend on the normal, coverages, open shares of direct
    // parts.
    std::size_t tallies = 0, coverages = 0, stride = 0;
    std::vector<double> values;
    std::vector<DirectPart> direct;                                             // sources and tallies only
    std::function<void(const SurfacePoint&, double, std::span<double>)> react;  // for steady coverages
    std::vector<Vec3> positions;                                                // empty if not needed
    double time = 0.0;                                                          // since the step began
    std::vector<std::uint8_t> visible;  // empty if line of sight is not needed
    std::vector<std::uint8_t> sealed;   // in a closed void; empty if there are none

    bool is_sealed(std::size_t sample) const { return !sealed.empty() && sealed[sample] != 0; }
    // SpeedLaw::speed_class of the samples, for a model that traces nothing and reads no position.
    std::vector<std::uint8_t> groups() const {
        if (stride != 0 || !positions.empty()) return {};
        std::vector<std::uint8_t> group(count);
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 16384), [&](const auto& range) {
            for (std::size_t n = range.begin(); n != range.end(); ++n)
                group[n] = static_cast<std::uint8_t>((visible.empty() || visible[n] != 0 ? 1 : 0) |
                                                     (is_sealed(n) ? 2 : 0));
        });
        return group;
    }
    // Calls use(point) with what the model would see at a sample if the normal there were \p normal.
    template <class Use>
    auto at(std::size_t sample, std::size_t layer, const Vec3& normal, Use&& use) const {
        const std::span<const double> here = std::span(values).subspan(sample * stride, stride);
        SurfacePoint point{materials[layer],
                           here.first(tallies),
                           normal,
                           visible.empty() || visible[sample] != 0,
                           here.subspan(tallies, coverages),
                           positions.empty() ? Vec3(Vec3::Zero()) : positions[sample],
                           time};
        if (direct.empty()) return use(point);
        const std::span<const double> before = here.first(tallies + coverages);
        boost::container::small_vector<double, 24> values_here(before.begin(), before.end());
        const std::span<double> turned(values_here.data(), values_here.size());
        std::span<const double> open = here.subspan(before.size());
        for (const DirectPart& part : direct) {
            const std::size_t shares = part.source->beams() * part.source->tallies();
            part.source->add(normal, static_cast<std::size_t>(point.material), open.first(shares),
                             turned.subspan(part.tally, part.source->tallies()));
            open = open.subspan(shares);
        }
        point.flux = turned.first(tallies);
        // If nothing arrives at this normal, steady coverages may not exist.
        const bool any = std::ranges::any_of(point.flux, [](double flux) { return flux > 0.0; });
        if (react && any) react(point, 0.0, turned.subspan(tallies));
        point.coverage = turned.subspan(tallies);
        return use(point);
    }
};

bool is_inert(const Model& model, int material) {
    return !model.hints.inert.empty() && model.hints.inert[static_cast<std::size_t>(material)] != 0;
}

// Whether V is at least 0 and equal on all materials, both in line of sight of the source and out of it.
bool grows_on_all_materials(const Model& model, const levelset::MaterialStack& stack,
                            const TracedSurface& surface) {
    if (!model.species.empty() || model.depends_on_position || model.depends_on_normal || model.speeds)
        return false;
    const auto same_where = [&](bool visible) {
        const auto speed = [&](const levelset::Layer& layer) {
            SurfacePoint point{layer.material};
            point.visible = visible;
            point.time = surface.time;
            return model.speed(point);
        };
        const double first = speed(stack.layers.front());
        return first >= 0.0 && std::ranges::all_of(stack.layers, [&](const levelset::Layer& layer) {
                   return speed(layer) == first;
               });
    };
    return same_where(true) && (!model.visibility || same_where(false));
}

// Marks the samples in closed voids, which stay unchanged in steps without particles; empty without voids.
std::vector<std::uint8_t> sealed_samples(const levelset::MaterialStack& stack, const TracedSurface& surface,
                                         const levelset::Extension& extension) {
    const levelset::Domain& domain = stack.domain;
    const std::vector<std::uint8_t> triangles = levelset::sealed_off(surface.raw, surface.pieces, domain);
    std::vector<std::uint8_t> sealed;
    if (triangles.empty()) return sealed;
    sealed.resize(extension.samples.size());
    const surface::RayScene scene(surface.raw);
    tbb::parallel_for(std::size_t{0}, sealed.size(), [&](std::size_t n) {
        const Vec3 foot = levelset::surface_point(extension.samples[n], domain);
        if (const auto nearest = scene.closest_point(foot, domain.spacing, domain.period()))
            sealed[n] = triangles[nearest.triangle];
    });
    return sealed;
}

// Interpolates fluxes and coverages; unless \p whole, fluxes lack direct parts, and their open shares follow.
void interpolate_parts(const SurfaceFlux& arriving, bool whole, std::uint32_t triangle, double u, double v,
                       std::span<double> values) {
    interpolate(arriving, triangle, u, v, values);
    std::size_t n = arriving.flux.size() + arriving.coverage.size();
    for (std::size_t part = 0; !whole && part < arriving.direct.size(); ++part) {
        const DirectPart& direct = arriving.direct[part];
        for (std::size_t k = 0; k < direct.rest.size(); ++k)
            values[direct.tally + k] =
                std::max(0.0, flux::interpolate(arriving.wedges, direct.rest[k], triangle, u, v));
        for (const std::vector<double>& open : direct.open)
            values[n++] = std::clamp(flux::interpolate(arriving.wedges, open, triangle, u, v), 0.0, 1.0);
    }
}

// Etch rate of each layer where it faces the beam; 1 for those that are not inert if the model does not tell.
std::vector<double> lit_etch_rates(const Model& model, const levelset::MaterialStack& stack) {
    std::vector<double> rates;
    for (const levelset::Layer& layer : stack.layers)
        rates.push_back(is_inert(model, layer.material) ? 0.0
                        : model.hints.max_etch_rate ? model.hints.max_etch_rate({.material = layer.material,
                                                                                 .normal = *model.visibility})
                                                    : 1.0);
    return rates;
}

// Collects fluxes, coverages, positions, line of sight and open shares of beams at the samples.
// \param hidden, shades  from choose_faces and shade_nodes, or empty.
SamplePoints sample_points(const Model& model, const levelset::MaterialStack& stack,
                           const TracedSurface& surface, const levelset::Extension& extension,
                           std::span<const std::uint8_t> hidden, std::span<const double> shades) {
    const std::size_t count = extension.samples.size();
    SamplePoints samples;
    samples.count = count;
    for (const levelset::Layer& layer : stack.layers) samples.materials.push_back(layer.material);
    if (model.species.empty()) samples.sealed = sealed_samples(stack, surface, extension);
    if (surface.arriving) {
        samples.tallies = surface.arriving->flux.size();
        samples.coverages = surface.arriving->coverage.size();
        samples.stride = samples.tallies + samples.coverages;
        if (!model.speeds)
            for (const DirectPart& part : surface.arriving->direct) {
                samples.direct.push_back({part.source, part.tally, {}, {}});
                samples.stride += part.open.size();
            }
        if (are_steady(model.coverages)) samples.react = model.coverages.react;
    }
    samples.values.resize(count * samples.stride);
    samples.time = surface.time;
    samples.positions.resize(model.depends_on_position ? count : 0);
    samples.visible.resize(model.visibility ? count : 0);
    const bool inert_top = is_inert(model, stack.layers.back().material);
    // By layer, for a tilted beam: a vertical one does not etch what lies behind a wall.
    const std::vector<double> rates = model.visibility && !model.visibility->head<2>().isZero(0.0)
                                          ? lit_etch_rates(model, stack)
                                          : std::vector<double>();
    constexpr double kOutside = -0.01;  // cells: nodes farther out of the material are in the gas
    const TriangleMesh& mesh = surface.traced();
    std::vector<std::size_t> beam_of;  // by open share of a sample
    std::size_t beams = 0;
    for (const DirectPart& part : samples.direct)
        for (std::size_t b = 0; b < part.source->beams(); ++b, ++beams)
            beam_of.insert(beam_of.end(), part.source->tallies(), beams);
    std::vector<std::size_t> species_of;  // by tally
    for (std::size_t k = 0; k < model.species.size(); ++k)
        species_of.insert(species_of.end(), flux::tally_count(model.species[k]), k);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 256), [&](const auto& range) {
        for (std::size_t n = range.begin(); n != range.end(); ++n) {
            const levelset::SurfaceSample& s = extension.samples[n];
            const auto u = static_cast<double>(s.u), v = static_cast<double>(s.v);
            if (surface.arriving)
                interpolate_parts(*surface.arriving, samples.direct.empty(), s.triangle, u, v,
                                  std::span(samples.values).subspan(n * samples.stride, samples.stride));
            if (n >= extension.plain() && !shades.empty())
                for (std::size_t k = 0; k < species_of.size(); ++k)
                    samples.values[n * samples.stride + k] *=
                        shades[(n - extension.plain()) * model.species.size() + species_of[k]];
            for (std::size_t k = 0; n >= extension.plain() && !hidden.empty() && k < beam_of.size(); ++k)
                if (hidden[(n - extension.plain()) * beams + beam_of[k]] != 0)
                    samples.values[(n + 1) * samples.stride - beam_of.size() + k] = 0.0;
            if (model.depends_on_position) samples.positions[n] = levelset::surface_point(s, stack.domain);
            if (!model.visibility) continue;
            if (inert_top && extension.top_alone(n)) {  // it has no triangle, and its V is 0
                samples.visible[n] = 1;
                continue;
            }
            const auto [a, b, c] = mesh.triangles[s.triangle];
            const auto& x = mesh.vertices;
            const Vec3 point = (1.0 - u - v) * x[a] + u * x[b] + v * x[c];
            const Vec3 normal = area_vector(mesh, s.triangle).normalized(), foot = s.foot.cast<double>();
            const double dx = stack.domain.spacing;
            const bool is_shadowed =
                !rates.empty() && foot.dot(normal) > kOutside &&
                enters_slower_layer(stack, rates, levelset::surface_point(s, stack.domain) - dx * foot,
                                    *model.visibility);
            samples.visible[n] =
                !is_shadowed && in_line_of_sight(surface, point, normal, *model.visibility, dx);
        }
    });
    return samples;
}

// V by sample and layer, in one call of Model::speeds.
std::vector<double> speeds_at_once(const Model& model, const TracedSurface& surface,
                                   const SamplePoints& samples, const levelset::Extension& extension) {
    const std::vector<Vec3> normals = triangle_normals(surface.traced());
    std::vector<SurfacePoint> points;
    points.reserve(extension.samples.size() * samples.materials.size());
    for (std::size_t n = 0; n < extension.samples.size(); ++n)
        for (std::size_t layer = 0; layer < samples.materials.size(); ++layer)
            points.push_back(samples.at(n, layer, normals[extension.samples[n].triangle],
                                        [](SurfacePoint point) { return point; }));
    return model.speeds(points);
}

// The extension that a model needs. If nothing is traced, samples need a mesh only for line of sight, and a
// speed that is equal all over the surface needs only one sample.
levelset::Extension extension_of(const Model& model, const levelset::MaterialStack& stack,
                                 const TracedSurface& surface, bool same_growth,
                                 const levelset::LevelColumns* left_out) {
    if (surface.scene) return levelset::extend(stack.top(), stack.domain, *surface.scene, left_out);
    if (same_growth && !model.visibility &&
        levelset::sealed_off(surface.raw, surface.pieces, stack.domain).empty())
        return levelset::extend_uniform(stack.top());
    return levelset::extend_untraced(stack, surface.columns ? &surface.raw : nullptr,
                                     is_inert(model, stack.layers.back().material), left_out);
}

// Whether the front keeps sharp edges. An edge has all normals between those of its two faces. If a yield
// depends on the angle of incidence, fluxes traced on the faces do not hold for those.
bool keeps_edges(const Model& model) {
    const auto by_angle = [](const flux::Yield& yield) {
        return yield.angular != flux::Angular::none && yield.angular != flux::Angular::cosine;
    };
    const bool untraced_beam = model.beam && model.hints.beam_speed;  // faces at an edge keep their speeds
    if (untraced_beam) return true;
    return !model.depends_on_normal && std::ranges::none_of(model.species, [&](const flux::Species& species) {
        return std::ranges::any_of(species.yields, by_angle) ||
               (species.redeposition && by_angle(species.redeposition->yield));
    });
}

// The materials that stay as they are where all fluxes are those on an open wafer; none if V is not of fluxes
// alone.
std::vector<std::int32_t> inert_materials(const Model& model, const levelset::MaterialStack& stack,
                                          const SurfaceFlux& arriving) {
    const std::vector<double> flux(arriving.flux.size(), 1.0);
    std::vector<std::int32_t> inert;
    if (model.speeds || model.depends_on_position || !arriving.coverage.empty()) return inert;
    for (const levelset::Layer& layer : stack.layers)
        if (model.speed({.material = layer.material, .flux = flux}) == 0.0) inert.push_back(layer.material);
    return inert;
}

// The model's speed law at the samples.
levelset::SpeedLaw law_at(const std::shared_ptr<const SamplePoints>& points, const Model& model,
                          const levelset::MaterialStack& stack, const TracedSurface& surface,
                          const levelset::Extension& extension) {
    levelset::SpeedLaw law;
    law.depends_on_normal = model.depends_on_normal || !points->direct.empty();
    if (model.speeds) {
        law.speed = [points, speeds = speeds_at_once(model, surface, *points, extension),
                     layers = stack.layers.size()](std::size_t sample, std::size_t layer, const Vec3&) {
            return points->is_sealed(sample) ? 0.0 : speeds[sample * layers + layer];
        };
    } else {
        law.speed = [points, speed_of = model.speed](std::size_t sample, std::size_t layer,
                                                     const Vec3& normal) {
            return points->is_sealed(sample) ? 0.0 : points->at(sample, layer, normal, speed_of);
        };
        law.speed_class = points->groups();
    }
    if (!points->direct.empty()) {
        const std::vector<Vec3> normals = triangle_normals(surface.traced());
        for (const levelset::SurfaceSample& sample : extension.samples)
            law.normal.push_back(normals[sample.triangle].cast<float>());
    }
    const auto at_samples = [&](auto value_of) {
        return [points, value_of = std::move(value_of)](std::size_t sample, std::size_t layer) {
            using Value = decltype(points->at(sample, layer, Vec3::UnitZ(), value_of));
            return points->is_sealed(sample) ? Value{} : points->at(sample, layer, Vec3::UnitZ(), value_of);
        };
    };
    if (model.depends_on_normal && model.hints.max_etch_rate)
        law.max_etch_rate = at_samples(model.hints.max_etch_rate);
    else if (law.depends_on_normal)
        law.max_etch_rate = [speed = law.speed](std::size_t sample, std::size_t layer) {
            double most = 0.0;
            for (const double tilt : {0.0, 0.25, 0.5})
                for (int quarter = 0; quarter < (tilt > 0.0 ? 4 : 1); ++quarter) {
                    const double polar = std::numbers::pi * tilt, around = 0.5 * std::numbers::pi * quarter;
                    const Vec3 normal(std::sin(polar) * std::cos(around), std::sin(polar) * std::sin(around),
                                      std::cos(polar));
                    most = std::max(most, -speed(sample, layer, normal));
                }
            return most;
        };
    if (model.beam && model.hints.beam_speed) {
        law.beam = *model.beam;
        law.beam_speed = at_samples(model.hints.beam_speed);
    }
    law.planes = model.hints.planes;
    for (const levelset::Layer& layer : stack.layers) {
        law.inert.push_back(is_inert(model, layer.material));
        if (!model.hints.dissipation.empty())
            law.dissipation.push_back(model.hints.dissipation[static_cast<std::size_t>(layer.material)]);
    }
    return law;
}

levelset::Motion motion_of_level(const Model& model, const levelset::MaterialStack& stack,
                                 const TracedSurface& surface, Timing& timing,
                                 const levelset::LevelColumns* left_out) {
    const bool same_growth = grows_on_all_materials(model, stack, surface);
    levelset::Extension extension;
    {
        const PhaseClock clock(timing.extend);
        extension = extension_of(model, stack, surface, same_growth, left_out);
    }
    const PhaseClock clock(timing.rates);
    using levelset::Below;
    const bool sharp = keeps_edges(model), direct = surface.arriving && !surface.arriving->direct.empty();
    levelset::find_bodies(stack, extension,
                          same_growth                                           ? Below::nothing
                          : sharp || direct || !model.hints.dissipation.empty() ? Below::edges
                                                                                : Below::depths);
    std::vector<std::uint8_t> hidden;
    std::vector<double> shades;
    if (direct) {
        hidden = choose_faces(surface, stack, extension);
    } else if (sharp && surface.arriving) {
        const std::vector<std::int32_t> inert = inert_materials(model, stack, *surface.arriving);
        if (!inert.empty()) shades = shade_nodes(surface, stack, model.species, inert, extension);
    }
    const auto points =
        std::make_shared<const SamplePoints>(sample_points(model, stack, surface, extension, hidden, shades));
    levelset::SpeedLaw law = law_at(points, model, stack, surface, extension);
    law.same_growth = same_growth;
    law.keeps_edges = sharp;
    return {std::move(extension), std::move(law)};
}

}  // namespace

levelset::Motion surface_motion(const Model& model, const levelset::MaterialStack& stack,
                                const TracedSurface& surface, Timing& timing, bool everywhere,
                                const levelset::LevelColumns* left_out) {
    levelset::Motion motion = motion_of_level(model, stack, surface, timing, left_out);
    if (!stack.coarser) return motion;
    levelset::LevelColumns deep;
    if (!everywhere) deep = levelset::deep_columns(stack);
    motion.coarser = std::make_shared<const levelset::Motion>(
        surface_motion(model, *stack.coarser, surface, timing, everywhere, everywhere ? nullptr : &deep));
    return motion;
}

void interpolate(const SurfaceFlux& arriving, std::uint32_t triangle, double u, double v,
                 std::span<double> values) {
    std::size_t n = 0;
    // Barycentric weights are in single precision: on the edge opposite to a corner its weight may be -1e-7,
    // which must not make a flux negative.
    for (const auto& flux : arriving.flux)
        values[n++] = std::max(0.0, flux::interpolate(arriving.wedges, flux, triangle, u, v));
    for (const auto& theta : arriving.coverage)
        values[n++] = flux::interpolate(arriving.wedges, theta, triangle, u, v);
}

}  // namespace sidewall::app
