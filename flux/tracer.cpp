#include "flux/tracer.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <mutex>

#include "flux/flight.hpp"
#include "flux/random.hpp"
#include "flux/sampling.hpp"
#include "surface/error.hpp"

namespace sidewall::flux {
namespace {

struct Counts {
    std::uint64_t absorbed = 0, escaped = 0, leaked = 0, arrivals = 0, segments = 0, rescued = 0;
};

// Everything a history reads. Shared by all threads.
struct Trace {
    Stage stage;
    RandomKey key;
    double exponent;
    std::vector<double> sticking;  // by material id
    std::span<const std::int32_t> materials;
    std::uint64_t batch_rays;
    std::uint32_t max_bounces;

    double sticking_of(std::uint32_t triangle) const {
        return sticking[materials.empty() ? 0 : static_cast<std::size_t>(materials[triangle])];
    }
};

Particle emit(const Trace& trace, std::uint64_t ray) {
    const Draws draws = draw(trace.key, ray, 0);
    const LateralBox& box = trace.stage.box;
    const auto [x, y] =
        sample_square(ray % trace.batch_rays, trace.batch_rays, draws.uniform(0), draws.word[1]);
    const Vec3 position(box.min[0] + x * (box.max[0] - box.min[0]),
                        box.min[1] + y * (box.max[1] - box.min[1]), trace.stage.top);
    const Vec3 down = -Vec3::UnitZ();
    const double u = draws.uniform(2), v = draws.uniform(3);
    return {position, trace.exponent == 1.0 ? sample_lambertian(down, u, v)  // the common case, and cheaper
                                            : sample_cosine_power(down, trace.exponent, u, v)};
}

Particle scatter(const Trace& trace, const Particle& incoming, const Landing& landing, const Draws& draws) {
    Vec3 normal = outward_normal(trace.stage, landing.triangle);
    if (normal.isZero(0.0)) normal = -incoming.direction;  // no area, no normal: back where it came from
    return {point_above(trace.stage, landing, normal),
            sample_lambertian(normal, draws.uniform(1), draws.uniform(2)), landing.triangle};
}

// One particle from the source to its end.
void trace_history(const Trace& trace, std::uint64_t ray, Tally& tally, Counts& counts) {
    Particle particle = emit(trace, ray);
    for (std::uint32_t bounce = 1; bounce <= trace.max_bounces; ++bounce) {
        const Landing landing = fly(trace.stage, particle);
        counts.segments += landing.segments;
        if (landing.end != End::hit) {
            ++(landing.end == End::escaped ? counts.escaped : counts.leaked);
            return;
        }
        ++counts.arrivals;
        counts.rescued += landing.rescued;
        tally.add(landing.triangle, landing.u, landing.v);
        const Draws draws = draw(trace.key, ray, bounce);
        if (draws.uniform(0) < trace.sticking_of(landing.triangle)) {
            ++counts.absorbed;
            return;
        }
        particle = scatter(trace, particle, landing, draws);
    }
    ++counts.leaked;
}

// Tells the caller how far the trace is, and asks whether to go on. Thread-safe.
class Monitor {
  public:
    Monitor(const TraceOptions& options, std::uint64_t rays) : options_(options), rays_(rays) {}
    bool stopped() {
        if (!stopped_ && options_.stop && options_.stop()) stopped_ = true;
        return stopped_;
    }
    void finished(std::uint64_t rays) {
        const std::uint64_t done = done_ += rays;
        if (!options_.progress) return;
        const std::unique_lock lock(mutex_, std::try_to_lock);
        if (lock) options_.progress(static_cast<double>(done) / static_cast<double>(rays_));
    }

  private:
    const TraceOptions& options_;
    std::uint64_t rays_;
    std::atomic<std::uint64_t> done_ = 0;
    std::atomic<bool> stopped_ = false;
    std::mutex mutex_;
};

// The one loop over rays. Rays of a batch follow a Hilbert curve over the source, so a task's rays start
// close together.
Counts trace_batch(const Trace& trace, std::uint64_t batch, std::uint32_t task_rays, Tally& tally,
                   Monitor& monitor) {
    std::mutex mutex;
    Counts total;
    const tbb::blocked_range rays(batch * trace.batch_rays, (batch + 1) * trace.batch_rays, task_rays);
    tbb::parallel_for(
        rays,
        [&](const tbb::blocked_range<std::uint64_t>& range) {
            if (monitor.stopped()) return;
            Counts counts;
            for (std::uint64_t ray = range.begin(); ray < range.end(); ++ray)
                trace_history(trace, ray, tally, counts);
            monitor.finished(range.size());
            const std::lock_guard lock(mutex);
            total.absorbed += counts.absorbed;
            total.escaped += counts.escaped;
            total.leaked += counts.leaked;
            total.arrivals += counts.arrivals;
            total.segments += counts.segments;
            total.rescued += counts.rescued;
        },
        tbb::simple_partitioner{});
    return total;
}

void check(const TriangleMesh& mesh, const LateralBox& box, const Species& species,
           std::span<const std::int32_t> materials, const Wedges& wedges, const TraceOptions& options) {
    if (!(species.source_exponent >= 0.0 && species.source_exponent <= 1e6))
        throw RecipeError(fmt::format("{}: source_exponent = {}: must be in [0, 1e6]", species.name,
                                      species.source_exponent));
    if (species.sticking.empty())
        throw RecipeError(
            fmt::format("{}: no sticking probability: give one, or one a material", species.name));
    for (const double s : species.sticking)
        if (!(s >= 0.0 && s <= 1.0))
            throw RecipeError(fmt::format("{}: sticking = {}: must be in [0, 1]", species.name, s));
    if (options.rays < 1 || options.rays > 1'000'000'000'000)
        throw RecipeError(fmt::format("rays = {}: must be 1 to 1e12", options.rays));
    if (options.batches < 16 || options.batches > 65536)
        throw RecipeError(fmt::format("batches = {}: must be 16 to 65536", options.batches));
    if (options.task_rays < 1 || options.max_bounces < 1)
        throw RecipeError("task_rays and max_bounces must be at least 1");
    if (!(box.area() > 0.0)) throw GeometryError("the lateral box has no area: take it from lateral_box");
    if (wedges.corner.size() != 3 * mesh.triangles.size() || wedges.first.size() != mesh.vertices.size() + 1)
        throw GeometryError("the wedges belong to another mesh: make them anew after the mesh changed");
    if (materials.empty()) return;
    if (materials.size() != mesh.triangles.size())
        throw GeometryError(fmt::format("{} materials for {} triangles: give one a triangle",
                                        materials.size(), mesh.triangles.size()));
    for (std::size_t t = 0; t < materials.size(); ++t)
        if (materials[t] < 0 || (species.sticking.size() > 1 &&
                                 static_cast<std::size_t>(materials[t]) >= species.sticking.size()))
            throw RecipeError(
                fmt::format("{}: triangle {} is of material {}, which has no sticking probability",
                            species.name, t, materials[t]));
}

double relative_error(const FluxField& field, const TriangleMesh& mesh) {
    std::vector<double> area(mesh.vertices.size(), 0.0);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (const std::uint32_t v : mesh.triangles[t]) area[v] += triangle_area(mesh, t) / 3.0;
    double error = 0.0, flux = 0.0;
    for (std::size_t v = 0; v < area.size(); ++v) {
        error += area[v] * field.error[v];
        flux += area[v] * field.flux[v];
    }
    return flux > 0.0 ? error / flux : std::numeric_limits<double>::infinity();
}

}  // namespace

FluxResult trace_flux(const TriangleMesh& mesh, const surface::RayScene& scene, const LateralBox& box,
                      const Species& species, std::span<const std::int32_t> materials, const Wedges& wedges,
                      const TraceOptions& options) {
    const auto start = std::chrono::steady_clock::now();
    check(mesh, box, species, materials, wedges, options);
    const bool one_sticking = species.sticking.size() == 1;
    const Trace trace{make_stage(mesh, scene, box),
                      random_key(options.seed, options.step, options.species_index),
                      species.source_exponent,
                      species.sticking,
                      one_sticking ? std::span<const std::int32_t>{} : materials,
                      (options.rays + options.batches - 1) / options.batches,
                      options.max_bounces};
    FluxResult result;
    result.emitted = trace.batch_rays * options.batches;
    Tally tally(mesh, wedges);
    Monitor monitor(options, result.emitted);
    for (std::uint64_t batch = 0; batch < options.batches; ++batch) {
        const Counts counts = trace_batch(trace, batch, options.task_rays, tally, monitor);
        if (monitor.stopped()) throw Interrupted("interrupted while tracing " + species.name);
        tally.close_batch();
        result.absorbed += counts.absorbed;
        result.escaped += counts.escaped;
        result.leaked += counts.leaked;
        result.arrivals += counts.arrivals;
        result.segments += counts.segments;
        result.rescued += counts.rescued;
    }
    const double area_per_ray = box.area() / static_cast<double>(result.emitted);
    result.triangle = tally.triangle_flux(area_per_ray);
    result.wedge = tally.wedge_flux(area_per_ray);
    result.vertex = tally.vertex_flux(area_per_ray);
    result.relative_error = relative_error(result.vertex, mesh);
    result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return result;
}

FluxResult trace_flux_to(double target, const TriangleMesh& mesh, const surface::RayScene& scene,
                         const LateralBox& box, const Species& species,
                         std::span<const std::int32_t> materials, const Wedges& wedges,
                         const TraceOptions& options) {
    if (!(target > 0.0)) throw RecipeError(fmt::format("relative_error = {}: must be above 0", target));
    TraceOptions attempt = options;
    attempt.rays = std::min<std::uint64_t>(options.rays, 2 * mesh.triangles.size() + 16384);
    while (true) {
        FluxResult result = trace_flux(mesh, scene, box, species, materials, wedges, attempt);
        if (result.relative_error <= target) return result;
        if (attempt.rays >= options.rays)
            throw NumericsError(
                fmt::format("relative error {:.3g} after {} rays, above the {:.3g} asked for: allow more "
                            "rays or ask for less",
                            result.relative_error, result.emitted, target));
        // The error falls as 1/sqrt(rays), but a sparse trace underestimates it: do not leap too far.
        const double growth = std::pow(result.relative_error / target, 2.0) * 1.1;
        const double rays = static_cast<double>(attempt.rays) * std::clamp(growth, 1.5, 16.0);
        attempt.rays =
            rays < static_cast<double>(options.rays) ? static_cast<std::uint64_t>(rays) : options.rays;
    }
}

}  // namespace sidewall::flux
