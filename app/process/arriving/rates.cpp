#include "app/process/arriving/rates.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "levelset/layers/levels.hpp"
#include "levelset/meshes/voids.hpp"
#include "levelset/motion/speed_extension.hpp"

namespace sidewall::app {
namespace {

// What the model sees at every sample of the extension.
struct SamplePoints {
    std::vector<int> materials;  // by layer
    std::size_t count = 0;
    std::size_t tallies = 0, stride = 0;  // values a sample: fluxes first, then coverages
    std::vector<double> values;
    std::vector<Vec3> positions;        // empty where they do not count
    double time = 0.0;                  // since the step began
    std::vector<std::uint8_t> visible;  // empty where line of sight does not count
    std::vector<std::uint8_t> sealed;   // in a closed void, where nothing gets in; empty if there are none

    bool is_sealed(std::size_t sample) const { return !sealed.empty() && sealed[sample] != 0; }
    // What a model can tell apart where nothing is traced.
    std::vector<std::uint8_t> kinds() const {
        if (stride != 0 || !positions.empty()) return {};
        std::vector<std::uint8_t> kind(count);
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 16384), [&](const auto& range) {
            for (std::size_t n = range.begin(); n != range.end(); ++n)
                kind[n] = static_cast<std::uint8_t>((visible.empty() || visible[n] != 0 ? 1 : 0) |
                                                    (is_sealed(n) ? 2 : 0));
        });
        return kind;
    }
    SurfacePoint at(std::size_t sample, std::size_t layer, const Vec3& normal) const {
        const std::span<const double> here = std::span(values).subspan(sample * stride, stride);
        return {materials[layer],
                here.first(tallies),
                normal,
                visible.empty() || visible[sample] != 0,
                here.subspan(tallies),
                positions.empty() ? Vec3(Vec3::Zero()) : positions[sample],
                time};
    }
};

// The surface point of a sample; world.
Vec3 position_of(const levelset::SurfaceSample& s, const levelset::Domain& domain) {
    const double dx = domain.spacing;
    return {domain.min[0] + dx * (s.node.x() + static_cast<double>(s.foot.x())),
            domain.min[1] + dx * (s.node.y() + static_cast<double>(s.foot.y())),
            dx * (s.node.z() + static_cast<double>(s.foot.z()))};
}

bool is_inert(const Model& model, int material) {
    return !model.inert.empty() && model.inert[static_cast<std::size_t>(material)] != 0;
}

// Whether the surface grows everywhere at one and the same speed, whatever is bare.
bool grows_alike(const Model& model, const levelset::MaterialStack& stack, const TracedSurface& surface) {
    if (!model.species.empty() || model.visibility || model.depends_on_position || model.depends_on_normal ||
        model.speeds)
        return false;
    const auto speed = [&](const levelset::Layer& layer) {
        SurfacePoint point{layer.material};
        point.time = surface.time;
        return model.speed(point);
    };
    const double first = speed(stack.layers.front());
    return first >= 0.0 &&
           std::all_of(stack.layers.begin(), stack.layers.end(),
                       [&](const levelset::Layer& layer) { return speed(layer) == first; }) &&
           levelset::sealed_off(surface.raw, surface.pieces, stack.domain).empty();
}

// The samples in closed voids, where nothing of a step without particles gets in either; empty if there are
// none.
std::vector<std::uint8_t> sealed_samples(const levelset::MaterialStack& stack, const TracedSurface& surface,
                                         const levelset::Extension& extension) {
    const levelset::Domain& domain = stack.domain;
    const std::vector<std::uint8_t> triangles = levelset::sealed_off(surface.raw, surface.pieces, domain);
    std::vector<std::uint8_t> sealed;
    if (triangles.empty()) return sealed;
    sealed.resize(extension.samples.size());
    const surface::RayScene scene(surface.raw);
    tbb::parallel_for(std::size_t{0}, sealed.size(), [&](std::size_t n) {
        const Vec3 foot = position_of(extension.samples[n], domain);
        if (const auto nearest = scene.closest_point(foot, domain.spacing))
            sealed[n] = triangles[nearest.triangle];
    });
    return sealed;
}

// Fluxes and coverages at the samples, and what each of them sees of the source.
SamplePoints sample_points(const Model& model, const levelset::MaterialStack& stack,
                           const TracedSurface& surface, const levelset::Extension& extension) {
    const std::size_t count = extension.samples.size();
    SamplePoints samples;
    samples.count = count;
    for (const levelset::Layer& layer : stack.layers) samples.materials.push_back(layer.material);
    if (model.species.empty()) samples.sealed = sealed_samples(stack, surface, extension);
    if (surface.arriving) {
        samples.tallies = surface.arriving->flux.size();
        samples.stride = samples.tallies + surface.arriving->coverage.size();
    }
    samples.values.resize(count * samples.stride);
    samples.time = surface.time;
    samples.positions.resize(model.depends_on_position ? count : 0);
    samples.visible.resize(model.visibility ? count : 0);
    const bool inert_top = is_inert(model, stack.layers.back().material);
    const TriangleMesh& mesh = surface.traced();
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 256), [&](const auto& range) {
        for (std::size_t n = range.begin(); n != range.end(); ++n) {
            const levelset::SurfaceSample& s = extension.samples[n];
            const auto u = static_cast<double>(s.u), v = static_cast<double>(s.v);
            if (surface.arriving)
                interpolate(*surface.arriving, s.triangle, u, v,
                            std::span(samples.values).subspan(n * samples.stride, samples.stride));
            if (model.depends_on_position) samples.positions[n] = position_of(s, stack.domain);
            if (!model.visibility) continue;
            if (inert_top && extension.top_alone(n)) {  // it has no triangle, nor does anything ask
                samples.visible[n] = 1;
                continue;
            }
            const auto [a, b, c] = mesh.triangles[s.triangle];
            const auto& x = mesh.vertices;
            const Vec3 point = (1.0 - u - v) * x[a] + u * x[b] + v * x[c];
            samples.visible[n] = visible(surface, point, area_vector(mesh, s.triangle).normalized(),
                                         *model.visibility, stack.domain.spacing);
        }
    });
    return samples;
}

// V of every layer at every sample, sample by sample, from Model::speeds.
std::vector<double> speeds_at_once(const Model& model, const TracedSurface& surface,
                                   const SamplePoints& samples, const levelset::Extension& extension) {
    const std::vector<Vec3> normals = triangle_normals(surface.traced());
    std::vector<SurfacePoint> points;
    points.reserve(extension.samples.size() * samples.materials.size());
    for (std::size_t n = 0; n < extension.samples.size(); ++n)
        for (std::size_t layer = 0; layer < samples.materials.size(); ++layer)
            points.push_back(samples.at(n, layer, normals[extension.samples[n].triangle]));
    return model.speeds(points);
}

levelset::Motion motion_of_level(const Model& model, const levelset::MaterialStack& stack,
                                 const TracedSurface& surface, Timing& timing,
                                 const levelset::LevelColumns* left_out) {
    levelset::Extension extension;
    {
        const PhaseClock clock(timing.extend);
        // Where nothing is traced, only line of sight asks for points on the mesh.
        extension = surface.scene ? levelset::extend(stack.top(), stack.domain, *surface.scene, left_out)
                    : grows_alike(model, stack, surface)
                        ? levelset::extend_uniform(stack.top())
                        : levelset::extend_untraced(stack, surface.columns ? &surface.raw : nullptr,
                                                    is_inert(model, stack.layers.back().material), left_out);
    }
    const PhaseClock clock(timing.rates);
    const auto points = std::make_shared<const SamplePoints>(sample_points(model, stack, surface, extension));
    levelset::SpeedFunction speed = [points, speed_of = model.speed](std::size_t sample, std::size_t layer,
                                                                     const Vec3& normal) {
        return points->is_sealed(sample) ? 0.0 : speed_of(points->at(sample, layer, normal));
    };
    if (model.speeds)
        speed = [points, speeds = speeds_at_once(model, surface, *points, extension),
                 layers = stack.layers.size()](std::size_t sample, std::size_t layer, const Vec3&) {
            return points->is_sealed(sample) ? 0.0 : speeds[sample * layers + layer];
        };
    levelset::Motion motion =
        levelset::make_motion(stack, std::move(extension), std::move(speed), model.depends_on_normal,
                              model.speeds ? std::vector<std::uint8_t>() : points->kinds());
    if (model.depends_on_normal && model.max_etch_rate)
        motion.max_etch_rate = [points, rate_of = model.max_etch_rate](std::size_t sample,
                                                                       std::size_t layer) {
            return points->is_sealed(sample) ? 0.0 : rate_of(points->at(sample, layer, Vec3::UnitZ()));
        };
    for (const levelset::Layer& layer : stack.layers) {
        motion.inert.push_back(is_inert(model, layer.material));
        if (!model.dissipation.empty())
            motion.dissipation.push_back(model.dissipation[static_cast<std::size_t>(layer.material)]);
    }
    if (model.beam && model.beam_speed) {
        motion.beam = *model.beam;
        motion.beam_speed = [points, speed_of = model.beam_speed](std::size_t sample, std::size_t layer) {
            return points->is_sealed(sample) ? levelset::BeamSpeed{}
                                             : speed_of(points->at(sample, layer, Vec3::UnitZ()));
        };
    }
    return motion;
}

// \param left_out  as of levelset::extend.
levelset::Motion motion_of_levels(const Model& model, const levelset::MaterialStack& stack,
                                  const TracedSurface& surface, Timing& timing, bool everywhere,
                                  const levelset::LevelColumns* left_out) {
    levelset::Motion motion = motion_of_level(model, stack, surface, timing, left_out);
    if (!stack.coarser) return motion;
    levelset::LevelColumns deep;
    if (!everywhere) deep = levelset::deep_columns(stack);
    motion.coarser = std::make_shared<const levelset::Motion>(
        motion_of_levels(model, *stack.coarser, surface, timing, everywhere, everywhere ? nullptr : &deep));
    return motion;
}

}  // namespace

levelset::Motion surface_motion(const Model& model, const levelset::MaterialStack& stack,
                                const TracedSurface& surface, Timing& timing, bool everywhere) {
    return motion_of_levels(model, stack, surface, timing, everywhere, nullptr);
}

void interpolate(const SurfaceFlux& arriving, std::uint32_t triangle, double u, double v,
                 std::span<double> values) {
    std::size_t n = 0;
    // Weights are in single precision: on the edge across from a corner, its own may be -1e-7. No flux is
    // negative for that.
    for (const auto& flux : arriving.flux)
        values[n++] = std::max(0.0, flux::interpolate(arriving.wedges, flux, triangle, u, v));
    for (const auto& theta : arriving.coverage)
        values[n++] = flux::interpolate(arriving.wedges, theta, triangle, u, v);
}

bool visible(const TracedSurface& surface, const Vec3& point, const Vec3& normal, const Vec3& direction,
             double spacing) {
    Vec3 position = point + 1e-2 * spacing * (normal + direction), path = direction;
    if (surface.box.boundary[0] != flux::Boundary::open)
        for (int axis = 0; axis < 2; ++axis) {
            const auto a = static_cast<std::size_t>(axis);
            position[axis] = std::clamp(position[axis], surface.box.min[a], surface.box.max[a]);
        }
    // A periodic strip one cell wide is the same at all y: there is nothing to meet on the way along it.
    if (surface.box.boundary[1] == flux::Boundary::periodic &&
        surface.box.max[1] - surface.box.min[1] < 1.5 * spacing)
        path.y() = 0.0;
    if (surface.columns) {
        // From below a ceiling that meets the surface here: raised into it, the point would no longer lie
        // under it.
        position.z() -= 2e-2 * spacing;
        return surface.columns->open_above(position);
    }
    // A path that crosses so many sides before it rises above the surface is flat but for rounding (below
    // 0.006 degrees where the surface is as high as the domain is wide); it counts as shadowed.
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

}  // namespace sidewall::app
