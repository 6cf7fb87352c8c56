#include "flux/tracer.hpp"

#include <fmt/format.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <mutex>

#include "flux/check.hpp"
#include "flux/history.hpp"
#include "surface/error.hpp"

namespace sidewall::flux {
namespace {

// A batch's bins and counters hold this many particles whatever they do; more rays make more batches.
constexpr std::uint64_t kMostBatchRays = std::uint64_t{1} << 24;

std::uint32_t fixed_probability(double s) {
    return static_cast<std::uint32_t>(s * static_cast<double>(kOne) + 0.5);
}

Sticking make_sticking(const std::vector<double>& by_material, std::span<const std::int32_t> materials,
                       std::span<const double> by_wedge) {
    Sticking sticking;
    sticking.by_wedge.assign(by_wedge.begin(), by_wedge.end());
    if (by_material.size() == 1 || materials.empty()) {
        sticking.by_triangle = {fixed_probability(by_material[0])};
        return sticking;
    }
    sticking.by_triangle.resize(materials.size());
    for (std::size_t t = 0; t < materials.size(); ++t)
        sticking.by_triangle[t] = fixed_probability(by_material[static_cast<std::size_t>(materials[t])]);
    return sticking;
}

// Tells the caller how far the trace is, and asks whether to go on. Thread-safe.
class Monitor {
  public:
    explicit Monitor(const TraceOptions& options) : options_(options) {}
    bool stop() {
        if (!stopped_ && options_.stop && options_.stop()) stopped_ = true;
        return stopped_;
    }
    /// \p rays may grow as the trace goes on; the fraction told does not fall.
    void expect(std::uint64_t rays) { rays_ = rays; }
    void finished(std::uint64_t rays) {
        const std::uint64_t done = done_ += rays;
        if (!options_.progress) return;
        const std::unique_lock lock(mutex_, std::try_to_lock);
        if (!lock) return;
        told_ = std::max(told_, std::min(1.0, static_cast<double>(done) / static_cast<double>(rays_)));
        options_.progress(told_);
    }

  private:
    const TraceOptions& options_;
    std::uint64_t rays_ = 1;
    std::atomic<std::uint64_t> done_ = 0;
    std::atomic<bool> stopped_ = false;
    std::mutex mutex_;
    double told_ = 0.0;
};

// A trace under way: rounds of batches of equal size, each on all threads.
class Tracer {
  public:
    Tracer(const TriangleMesh& mesh, const surface::RayScene& scene, const LateralBox& box,
           const Species& species, std::span<const std::int32_t> materials, const Wedges& wedges,
           const TraceOptions& options)
        : box_(box),
          species_(species),
          options_(options),
          monitor_(options),
          trace_{make_stage(mesh, scene, box),
                 species,
                 wedges,
                 random_key(options.seed, options.step, options.species_index),
                 make_sticking(species.sticking, materials, options.sticking_by_wedge),
                 {},
                 materials,
                 fixed_probability(options.roulette),
                 options.max_bounces,
                 [this] { return monitor_.stop(); }} {
        if (species.redeposition)
            trace_.redeposition = make_sticking(species.redeposition->sticking, materials, {});
        for (std::size_t k = 0; k < tally_count(species); ++k) tallies_.emplace_back(mesh, wedges);
    }

    /// Traces at least \p rays more, in equal batches.
    void trace_round(std::uint64_t rays) {
        const std::uint64_t batches =
            std::max<std::uint64_t>(options_.batches, (rays + kMostBatchRays - 1) / kMostBatchRays);
        const auto batch_rays = static_cast<std::uint32_t>((rays + batches - 1) / batches);
        for (std::uint64_t b = 0; b < batches; ++b)
            trace_batch(make_batch(trace_.key, batches_++, batch_rays));
        for (Tally& tally : tallies_) tally.close_round();
    }

    std::uint64_t emitted() const { return counts_.emitted; }
    void expect(std::uint64_t rays) { monitor_.expect(rays); }

    /// sum(area * standard error) / sum(area * flux) over vertices so far.
    double relative_error() const { return relative_error(tallies_[0].vertex_flux(area_per_ray())); }

    FluxResult result() const {
        FluxResult result;
        static_cast<TallyFlux&>(result) = flux_of(tallies_[0]);
        for (std::size_t k = 1; k < tallies_.size(); ++k) result.others.push_back(flux_of(tallies_[k]));
        result.emitted = counts_.emitted;
        result.absorbed = counts_.absorbed;
        result.escaped = counts_.escaped;
        result.leaked = counts_.leaked;
        result.arrivals = counts_.arrivals;
        result.segments = counts_.flights.segments;
        result.rescued = counts_.flights.rescued;
        result.ledger = counts_.ledger;
        result.redeposited = counts_.redeposited;
        result.relative_error = relative_error(result.vertex);
        result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
        return result;
    }

  private:
    double relative_error(const FluxField& vertex) const {
        const Wedges& wedges = trace_.wedges;
        double error = 0.0, flux = 0.0;
        for (std::size_t v = 0; v < vertex.flux.size(); ++v) {
            double area = 0.0;
            for (std::uint32_t w = wedges.first[v]; w < wedges.first[v + 1]; ++w) area += wedges.area[w];
            error += area * vertex.error[v];
            flux += area * vertex.flux[v];
        }
        return flux > 0.0 ? error / flux : std::numeric_limits<double>::infinity();
    }

    double area_per_ray() const { return box_.area() / static_cast<double>(counts_.emitted); }
    TallyFlux flux_of(const Tally& tally) const {
        const double scale = area_per_ray();
        return {tally.triangle_flux(scale), tally.wedge_flux(scale), tally.vertex_flux(scale)};
    }

    Worker& worker() {
        std::unique_ptr<Worker>& local = workers_.local();
        if (!local) {
            local = std::make_unique<Worker>();
            for (Tally& tally : tallies_) local->bins.push_back(&tally.bins());
        }
        return *local;
    }

    // Blocks are the same whatever the tasks: only whole ones are handed out.
    void trace_batch(const Batch& batch) {
        const std::uint32_t blocks = static_cast<std::uint32_t>((batch.count + kBlock - 1) / kBlock);
        const std::size_t task_blocks = std::max<std::size_t>(1, options_.task_rays / kBlock);
        tbb::parallel_for(
            tbb::blocked_range<std::uint32_t>(0, blocks, task_blocks),
            [&](const tbb::blocked_range<std::uint32_t>& range) {
                Worker& mine = worker();
                for (std::uint32_t block = range.begin(); block < range.end() && !monitor_.stop(); ++block) {
                    const auto first = static_cast<std::uint32_t>(block * kBlock);
                    const auto count = std::min(static_cast<std::uint32_t>(kBlock), batch.count - first);
                    trace_block(trace_, batch, first, count, tallies_, mine);
                    monitor_.finished(count);
                }
            },
            tbb::simple_partitioner{});
        if (monitor_.stop()) throw Interrupted("interrupted while tracing " + species_.name);
        for (std::unique_ptr<Worker>& worker : workers_) {
            if (!worker) continue;
            counts_.add(worker->counts);
            worker->counts = {};
        }
        for (Tally& tally : tallies_) tally.close_batch();
    }

    const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
    const LateralBox& box_;
    const Species& species_;
    const TraceOptions& options_;
    Monitor monitor_;
    Trace trace_;
    std::vector<Tally> tallies_;
    tbb::enumerable_thread_specific<std::unique_ptr<Worker>> workers_;
    Counts counts_;
    std::uint32_t batches_ = 0;
};

}  // namespace

FluxResult trace_flux(const TriangleMesh& mesh, const surface::RayScene& scene, const LateralBox& box,
                      const Species& species, std::span<const std::int32_t> materials, const Wedges& wedges,
                      const TraceOptions& options) {
    check(mesh, box, species, materials, wedges, options);
    Tracer tracer(mesh, scene, box, species, materials, wedges, options);
    tracer.expect(options.rays);
    tracer.trace_round(options.rays);
    return tracer.result();
}

FluxResult trace_flux_to(double target, const TriangleMesh& mesh, const surface::RayScene& scene,
                         const LateralBox& box, const Species& species,
                         std::span<const std::int32_t> materials, const Wedges& wedges,
                         const TraceOptions& options) {
    if (!(target > 0.0)) throw RecipeError(fmt::format("relative_error = {}: must be above 0", target));
    check(mesh, box, species, materials, wedges, options);
    Tracer tracer(mesh, scene, box, species, materials, wedges, options);
    std::uint64_t rays = std::min<std::uint64_t>(options.rays, 2 * mesh.triangles.size() + 16384);
    while (true) {
        tracer.expect(tracer.emitted() + rays);
        tracer.trace_round(rays);
        const std::uint64_t emitted = tracer.emitted();
        const double error = tracer.relative_error();
        if (error <= target || emitted >= options.rays) return tracer.result();
        // The error falls as 1/sqrt(rays), but a sparse trace underestimates it: do not leap too far.
        const double more = std::clamp(1.05 * std::pow(error / target, 2.0) - 1.0, 0.1, 7.0);
        rays = std::min(options.rays - emitted,
                        static_cast<std::uint64_t>(more * static_cast<double>(emitted)) + 1);
    }
}

}  // namespace sidewall::flux
