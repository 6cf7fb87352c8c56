#include "flux/tracer/tracer.hpp"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <tuple>
#include <utility>

#include "flux/direct.hpp"
#include "flux/tracer/adjoint.hpp"
#include "flux/tracer/monitor.hpp"
#include "flux/tracer/particle_history.hpp"
#include "flux/tracer/trace_checks.hpp"
#include "surface/error.hpp"

namespace sidewall::flux {
namespace {

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

// Species traced together, with their part of the options.
struct Pass {
    std::vector<Species> species;
    std::vector<std::span<const double>> by_wedge;  // sticking by species, or empty
    std::span<const double> emission;               // by wedge, only with a single species; or empty
    std::uint32_t species_index;
};

// Traces one pass, in rounds of batches of equal size, each batch on all threads.
class Tracer {
  public:
    Tracer(const TriangleMesh& mesh, const surface::RayScene& scene, const LateralBox& box, const Pass& pass,
           std::span<const std::int32_t> materials, const Wedges& wedges, const TraceOptions& options)
        : box_(box),
          pass_(pass),
          options_(options),
          monitor_(options.progress, options.stop),
          trace_{make_geometry(mesh, scene, box),
                 pass.species.front(),
                 wedges,
                 random_key(options.seed, options.time_step, pass.species_index),
                 {},
                 {},
                 {},
                 {},
                 materials,
                 fixed_probability(options.roulette),
                 options.max_bounces,
                 0,
                 uses_adjoint(pass.species, mesh, options),
                 [this] { return monitor_.stop(); }},
          counts_{std::vector<Counts>(pass.species.size()), {}} {
        for (std::size_t k = 0; k < pass.species.size(); ++k) {
            const Species& species = pass.species[k];
            trace_.active.push_back(k);
            trace_.sticking.push_back(make_sticking(species.sticking, materials, pass.by_wedge[k]));
            for (std::size_t n = 0; n < tally_count(species); ++n) tallies_.emplace_back(mesh, wedges);
        }
        if (options.reflected && has_direct_flux(pass.species.front())) {
            trace_.reflected = tallies_.size();
            for (std::size_t n = 0; n <= pass.species.front().yields.size(); ++n)
                tallies_.emplace_back(mesh, wedges);
        }
        if (const auto& redeposition = pass.species.front().redeposition)
            trace_.redeposition = make_sticking(redeposition->sticking, materials, {});
        trace_.desorption = make_surface_source(mesh, wedges, pass.emission, box.area());
    }

    /// Rays of the first round to a relative error, and the fewest rays of any round.
    std::uint64_t first_round() const {
        const Geometry& geometry = trace_.geometry;
        return flux::first_round(geometry.mesh.triangles.size(), geometry.revolution != nullptr);
    }
    std::uint64_t least_round() const {
        return trace_.adjoint ? fewest_adjoint_paths(trace_.geometry.mesh) : 1;
    }

    /// Traces at least \p rays more, or nearly as many adjoint paths, in equal batches of the active species.
    /// \pre rays >= least_round()
    void trace_round(std::uint64_t rays) {
        std::uint64_t batches =
            std::max<std::uint64_t>(options_.batches, (rays + kMostBatchRays - 1) / kMostBatchRays);
        auto batch_rays = static_cast<std::uint32_t>((rays + batches - 1) / batches);
        if (trace_.adjoint)
            std::tie(batches, batch_rays) = adjoint_batches(rays, batches, trace_.geometry.mesh);
        const bool alone = options_.shares.ranks == 1;
        for (std::uint64_t b = 0; b < batches; ++b) {
            trace_batch(make_batch(trace_.key, batches_++, batch_rays));
            alone ? close_batch() : hold_batch(batch_rays);
        }
        if (!alone) share_batches();
        for (Tally* tally : active_tallies()) tally->close_round();
    }

    std::uint64_t emitted() const { return emitted_; }
    void expect(std::uint64_t rays) { monitor_.expect(rays); }

    /// Removes species whose largest_error is at most \p target from the active ones.
    /// \returns the smallest and the largest error of those that remain, or zeros if none does.
    std::pair<double, double> retire_reached(double target) {
        double nearest = 0.0, farthest = 0.0;
        std::erase_if(trace_.active, [&](std::size_t k) {
            const FluxField all = tallies_[k].vertex_flux(area_per_ray(k)),
                            noisy = noisy_part(k).vertex_flux(area_per_ray(k));
            const double error = std::max(relative_error(all, noisy), redeposition_error());
            if (error <= target) return true;
            nearest = nearest > 0.0 ? std::min(nearest, error) : error;
            farthest = std::max(farthest, error);
            return false;
        });
        return {nearest, farthest};
    }

    std::vector<FluxResult> results() const {
        const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start_;
        std::vector<FluxResult> results;
        for (std::size_t k = 0; k < counts_.species.size(); ++k)
            results.emplace_back(result(k)).seconds = taken.count();
        return results;
    }

  private:
    FluxResult result(std::size_t k) const {
        const double scale = area_per_ray(k);
        FluxResult result;
        static_cast<Counts&>(result) = counts_.species[k];
        static_cast<TallyFlux&>(result) = flux_of(tallies_[k], scale);
        if (counts_.species.size() == 1)
            for (std::size_t n = 1; n < tallies_.size(); ++n)
                (trace_.reflected > 0 && n >= trace_.reflected ? result.reflected : result.others)
                    .push_back(flux_of(tallies_[n], scale));
        result.segments = counts_.flights.segments;
        result.rescued = counts_.flights.rescued;
        result.relative_error = relative_error(result.vertex, flux_of(noisy_part(k), scale).vertex);
        result.redeposition_error = redeposition_error();
        result.adjoint = trace_.adjoint;
        result.pass_species = static_cast<std::uint32_t>(counts_.species.size());
        result.pass_place = static_cast<std::uint32_t>(k);
        return result;
    }

    // The tally whose noise counts: reflected arrivals if they are tallied, as first arrivals are then
    // computed by visibility (flux/direct.hpp); else all arrivals.
    const Tally& noisy_part(std::size_t k) const {
        return tallies_[trace_.reflected > 0 ? trace_.reflected : k];
    }

    // FluxResult::relative_error: error of \p noisy over the flux of all arrivals, \p vertex.
    double relative_error(const FluxField& vertex, const FluxField& noisy) const {
        std::span<const double> where;  // weights by vertex: reflected particles reach few places
        if (trace_.reflected > 0 && integral(noisy.flux) > 0.0) where = noisy.flux;
        const double flux = integral(vertex.flux, where);
        return flux > 0.0 ? integral(noisy.error, where) / flux : kInfinity;
    }

    // FluxResult::redeposition_error. Redeposition is tally tally_count - 1 of a species alone in its pass.
    double redeposition_error() const {
        const double sputtered = static_cast<double>(counts_.species.front().redeposited.emitted) * 0x1p-28;
        if (!(sputtered > 0.0)) return 0.0;
        return integral(tallies_[tally_count(trace_.species) - 1].vertex_flux(1.0).error) / sputtered;
    }

    double integral(const std::vector<double>& by_vertex, std::span<const double> weights = {}) const {
        double sum = 0.0;
        for (std::size_t v = 0; v < by_vertex.size(); ++v)
            for (std::uint32_t w = trace_.wedges.first[v]; w < trace_.wedges.first[v + 1]; ++w)
                sum += trace_.wedges.area[w] * by_vertex[v] * (weights.empty() ? 1.0 : weights[v]);
        return sum;
    }

    // Area of an open wafer that gets one particle, at flux 1 of the source plane.
    double area_per_ray(std::size_t k) const {
        return box_.area() / (1.0 - trace_.desorption.share) /
               static_cast<double>(counts_.species[k].emitted);
    }
    TallyFlux flux_of(const Tally& tally, double scale) const {
        TallyFlux flux{tally.triangle_flux(scale), tally.wedge_flux(scale), tally.vertex_flux(scale)};
        if (trace_.geometry.revolution) {
            share_segments(trace_.geometry.mesh, flux.triangle);
            share_rings(flux.vertex);
        }
        return flux;
    }

    // All tallies of a single species; of several, which have one each, those of the active species.
    std::vector<Tally*> active_tallies() {
        std::vector<Tally*> active;
        for (std::size_t n = 0; n < tallies_.size(); ++n)
            if (counts_.species.size() == 1 || std::ranges::binary_search(trace_.active, n))
                active.push_back(&tallies_[n]);
        return active;
    }

    Worker& worker() {
        std::unique_ptr<Worker>& local = workers_.local();
        if (!local) {
            local = std::make_unique<Worker>();
            for (Tally& tally : tallies_) local->bins.push_back(&tally.bins());
            local->counts.resize(counts_.species.size());
            if (counts_.species.size() > 1) local->weights.resize(counts_.species.size());
        }
        return *local;
    }

    // Tasks consist of whole blocks, so that blocks do not depend on the task size. The ranks take blocks in
    // turn, continued from batch to batch.
    void trace_batch(const Batch& batch) {
        const Shares& shares = options_.shares;
        const auto blocks = static_cast<std::uint32_t>((batch.count + kBlock - 1) / kBlock);
        const std::uint32_t first_own = (shares.rank + shares.ranks - blocks_ % shares.ranks) % shares.ranks;
        const std::uint32_t own = first_own < blocks ? (blocks - first_own - 1) / shares.ranks + 1 : 0;
        blocks_ = (blocks_ + blocks) % shares.ranks;
        const std::size_t task_blocks = std::max<std::size_t>(1, options_.task_rays / kBlock);
        tbb::parallel_for(
            tbb::blocked_range<std::uint32_t>(0, own, task_blocks),
            [&](const tbb::blocked_range<std::uint32_t>& range) {
                Worker& mine = worker();
                for (std::uint32_t i = range.begin(); i < range.end() && !monitor_.stop(); ++i) {
                    const auto first = static_cast<std::uint32_t>((first_own + i * shares.ranks) * kBlock);
                    const auto count = std::min(static_cast<std::uint32_t>(kBlock), batch.count - first);
                    trace_block(trace_, batch, first, count, tallies_, mine);
                    monitor_.finished(std::uint64_t{count} * shares.ranks);
                }
            },
            tbb::simple_partitioner{});
        if (monitor_.stop()) {
            std::string names;
            for (const std::size_t k : trace_.active)
                names += (names.empty() ? "" : ", ") + pass_.species[k].name;
            throw Interrupted("interrupted while tracing " + names);
        }
        emitted_ += batch.count;
    }

    // Returns and clears this rank's counts of the batch just traced.
    PassCounts take_counts() {
        PassCounts batch{std::vector<Counts>(counts_.species.size()), {}};
        for (std::unique_ptr<Worker>& worker : workers_) {
            if (!worker) continue;
            batch.add({worker->counts, worker->flights});
            worker->counts.assign(counts_.species.size(), {});
            worker->flights = {};
        }
        return batch;
    }

    void add_counts(const PassCounts& batch) {
        if (batch.flights.segments >= kMostHits)
            throw NumericsError(
                "{}: a batch of rays flew {} times: its sums may overflow; use more flux.batches or fewer rays",
                pass_.species.front().name, batch.flights.segments);
        counts_.add(batch);
    }

    void close_batch() {
        add_counts(take_counts());
        for (Tally* tally : active_tallies()) tally->close_batch();
    }

    // Holds a batch back, to sum several over the ranks at once: ranks wait less often for the slowest.
    void hold_batch(std::uint32_t rays) {
        constexpr std::uint64_t kMostWords = 1 << 23, kMostRays = 1 << 21;  // for each rank: a second or two
        take_counts().write(held_);
        for (Tally* tally : active_tallies()) tally->take_batch(held_);
        ++held_batches_;
        if (held_.size() >= kMostWords ||
            held_batches_ * std::uint64_t{rays} >= options_.shares.ranks * kMostRays)
            share_batches();
    }

    void share_batches() {
        if (held_batches_ == 0) return;
        options_.shares.sum(held_);
        std::span<std::uint64_t> words(held_);
        PassCounts batch = take_counts();  // all 0: hold_batch has taken them
        for (; held_batches_ > 0; --held_batches_) {
            batch.read(words);
            add_counts(batch);
            for (Tally* tally : active_tallies()) {
                tally->close_batch(words.first(tally->bin_count()));
                words = words.subspan(tally->bin_count());
            }
        }
        held_.clear();
    }

    const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
    const LateralBox& box_;
    const Pass& pass_;
    const TraceOptions& options_;
    Monitor monitor_;
    Trace trace_;
    std::vector<Tally> tallies_;
    tbb::enumerable_thread_specific<std::unique_ptr<Worker>> workers_;
    PassCounts counts_;
    std::uint64_t emitted_ = 0;
    std::uint32_t batches_ = 0, blocks_ = 0;  // traced so far; blocks modulo the number of ranks
    std::vector<std::uint64_t> held_;         // counts and bins of batches not yet summed over the ranks
    std::uint32_t held_batches_ = 0;
};

// Traces rounds of batches until the relative error asked for is reached or all rays are spent.
std::vector<FluxResult> trace_rounds(const TraceOptions& options, Tracer& tracer) {
    const std::uint64_t most = options.rays;
    tracer.expect(most);
    if (!options.relative_error) {
        tracer.trace_round(most);
        return tracer.results();
    }
    const double target = *options.relative_error;
    double power = 1.75;  // rays grow as error^power; at first the error falls faster than 1/sqrt(rays)
    const auto growth = [&](double error) { return 1.05 * std::pow(error / target, power); };
    const std::uint64_t least = tracer.least_round();
    std::uint64_t rays = std::max(least, std::min(most, tracer.first_round()));
    while (true) {
        tracer.trace_round(rays);
        const std::uint64_t emitted = tracer.emitted();
        const auto [nearest, farthest] = tracer.retire_reached(target);
        if (nearest == 0.0 || emitted + least > most) return tracer.results();
        const auto spent = static_cast<double>(emitted);
        if (growth(farthest) * spent < static_cast<double>(most))
            tracer.expect(static_cast<std::uint64_t>(growth(farthest) * spent));
        // Until the next species should reach the target; 8-fold at most: sparse traces underestimate errors.
        const double more = std::clamp(growth(nearest) - 1.0, 0.1, 7.0);
        rays = std::min(most - emitted, std::max(least, static_cast<std::uint64_t>(more * spent) + 1));
        power = 2.0;
    }
}

}  // namespace

std::vector<std::vector<std::size_t>> passes_of(std::span<const Species> species) {
    constexpr std::size_t kMostTogether = 4;
    std::vector<std::vector<std::size_t>> passes;
    for (std::size_t k = 0; k < species.size(); ++k) {
        const auto pass = std::find_if(passes.begin(), passes.end(), [&](const auto& others) {
            return others.size() < kMostTogether && same_paths(species[others.front()], species[k]);
        });
        if (pass == passes.end())
            passes.push_back({k});
        else
            pass->push_back(k);
    }
    return passes;
}

FluxResult trace_flux(const TriangleMesh& mesh, const surface::RayScene& scene, const LateralBox& box,
                      const Species& species, std::span<const std::int32_t> materials, const Wedges& wedges,
                      const TraceOptions& options) {
    return std::move(trace_fluxes(mesh, scene, box, {&species, 1}, materials, wedges, options).front());
}

std::vector<FluxResult> trace_fluxes(const TriangleMesh& mesh, const surface::RayScene& scene,
                                     const LateralBox& box, std::span<const Species> species,
                                     std::span<const std::int32_t> materials, const Wedges& wedges,
                                     const TraceOptions& options) {
    const WedgeValues values = check(mesh, box, species, materials, wedges, options);
    const std::vector<std::vector<std::size_t>> passes = passes_of(species);
    std::vector<FluxResult> results(species.size());
    for (std::size_t p = 0; p < passes.size(); ++p) {
        Pass pass{{}, {}, {}, options.species_index + static_cast<std::uint32_t>(passes[p].front())};
        for (const std::size_t k : passes[p]) {
            pass.species.push_back(species[k]);
            pass.by_wedge.push_back(values.sticking[k]);
            if (species[k].desorbs) pass.emission = values.emission[k];
        }
        TraceOptions own = options;
        if (options.progress)
            own.progress = [&, p](double part) {
                options.progress((static_cast<double>(p) + part) / static_cast<double>(passes.size()));
            };
        Tracer tracer(mesh, scene, box, pass, materials, wedges, own);
        std::vector<FluxResult> traced = trace_rounds(own, tracer);
        for (std::size_t i = 0; i < traced.size(); ++i) results[passes[p][i]] = std::move(traced[i]);
    }
    return results;
}

}  // namespace sidewall::flux
