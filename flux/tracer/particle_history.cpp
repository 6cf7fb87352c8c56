// A particle's life, a block of kBlock particles at a time:
//
//     emit        a point of the source plane, or of a surface that desorbs,          source.cpp
//                 a direction, an energy                                              sampling.hpp
//                 or, by adjoint sampling, first arrivals drawn on the surface        adjoint.cpp
//     fly         to the next hit, eight particles at a time                          packets.cpp
//                 one by one where rounding matters                                   flight.cpp
//                 with collisions on the way, if the species has a mean free path     gas_collisions.cpp
//       no hit      it escaped, or leaked through a hole: its history ends
//       side hit    it is mirrored or wrapped and continues, or escapes
//       surface hit it reacts
//     react       at the surface, by species:
//       neutrals    of one species, or of several species on the same paths           hits.cpp
//       ions        and others with energy, yields, reflection or redeposition        hits.cpp
//     and at every hit, in this order:
//       tally       its weight, times each yield, on triangle and wedges              tally.hpp, yield.hpp
//       sputter     secondary particles, traced from `fly` on as neutrals             hits.cpp
//       stick       part of its weight is absorbed                                    particle_history.hpp
//       roulette    a small remaining weight becomes a whole particle or 0            particle_history.hpp
//       re-emit     by Lambert's law: back to `fly`                                   hits.cpp
//                   mirrored or in a cone: back to `fly`                              reflection.hpp
//
// A history ends absorbed, escaped or leaked. Every weight is booked in a Ledger, which balances to the last
// bit. Random numbers are keyed by seed, time step, species, batch, ray, bounce and generation (random.hpp).
// Blocks are distributed to threads, and their counts summed up, in tracer.cpp.
#include "flux/tracer/particle_history.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "flux/tracer/adjoint.hpp"
#include "flux/tracer/gas_collisions.hpp"
#include "flux/tracer/hits.hpp"

namespace sidewall::flux {
namespace {

// Ends particles that have bounced max_bounces times: their weight counts as leaked.
void terminate_as_leaked(Rays& r, std::span<Bundle> bundles) {
    for (const Bundle& bundle : bundles)
        for (std::size_t row = 0; row < r.count; ++row) {
            bundle.ledger->leaked += bundle.weight[row];
            if (bundle.counts) bundle.counts->leaked += bundle.weight[row] > 0;
        }
    r.count = 0;
}

// Flies \p rays to their next hit or out, and raises event.bounce; adjoint paths begin at their first hit.
// \returns false if the block is done: no ray is left, a stop was asked for, or the rays have bounced
// max_bounces times, which ends them as leaked.
bool fly_to_hit(const Trace& trace, std::span<Bundle> bundles, Rays& rays, Event& event,
                FlightCounts& flights) {
    // Ask during long histories, too, so that a stop takes effect soon.
    if (rays.count == 0 || (event.bounce % 256 == 255 && trace.stop())) return false;
    if (event.bounce++ == trace.max_bounces) {
        terminate_as_leaked(rays, bundles);
        return false;
    }
    if (trace.adjoint && event.bounce == 1 && event.generation == 0) return true;
    if (std::isfinite(trace.species.mean_free_path)) return fly_through_gas(trace, rays, event, flights);
    fly_block(trace.geometry, rays, flights);
    return true;
}

// Follows neutrals hit after hit: those in w.rays, or those that ions sputtered.
void follow_neutrals(const Trace& trace, Bundle bundle, Worker& w, Rays& rays, Event event) {
    while (fly_to_hit(trace, {&bundle, 1}, rays, event, w.flights))
        react_neutrals(trace, bundle, w, rays, event);
}

// Follows ions hit after hit; after each bounce, the sputtered particles are followed to their ends.
void follow_ions(const Trace& trace, Bundle bundle, Worker& w, Event event,
                 const std::vector<Tally>& tallies) {
    while (fly_to_hit(trace, {&bundle, 1}, w.rays, event, w.flights)) {
        react_ions(trace, bundle, w, event, tallies);
        if (w.secondaries.count == 0) continue;
        const std::size_t redeposited = tally_count(trace.species) - 1;
        const Bundle sputtered{bundle.species,
                               w.secondaries.weight.data(),
                               &trace.redeposition,
                               &tallies[redeposited],
                               w.bins[redeposited],
                               &bundle.counts->redeposited,
                               nullptr};
        follow_neutrals(trace, sputtered, w, w.secondaries,
                        {.batch = event.batch, .bounce = 0, .generation = event.bounce});
    }
}

// Follows several species on the same paths hit after hit, and removes those without weight from bundles. The
// last one is faster alone: returns with its weights in w.rays and its last hit in event.
void follow_shared(const Trace& trace, std::vector<Bundle>& bundles, Worker& w, Event& event) {
    for (Bundle& bundle : bundles) {
        bundle.weight = w.weights[bundle.species].data();
        std::copy_n(w.rays.weight.begin(), w.rays.count, bundle.weight);
    }
    while (fly_to_hit(trace, bundles, w.rays, event, w.flights)) {
        react_shared(trace, bundles, w, event);
        std::erase_if(bundles, [](const Bundle& bundle) { return bundle.survived == 0; });
        if (bundles.size() > 1) continue;
        if (bundles.empty()) return;
        std::copy_n(bundles.front().weight, w.rays.count, w.rays.weight.begin());
        bundles.front().weight = w.rays.weight.data();
        return;
    }
    bundles.clear();
}

}  // namespace

void PassCounts::add(PassCounts other) {
    std::vector<std::uint64_t> more;
    other.write(more);
    auto next = more.begin();
    each_word([&](std::uint64_t& word) { word += *next++; });
}

void PassCounts::write(std::vector<std::uint64_t>& words) {
    each_word([&](std::uint64_t word) { words.push_back(word); });
}

void PassCounts::read(std::span<std::uint64_t>& words) {
    each_word([&](std::uint64_t& word) {
        word = words.front();
        words = words.subspan(1);
    });
}

void trace_block(const Trace& trace, const Batch& batch, std::uint32_t first, std::uint32_t count,
                 const std::vector<Tally>& tallies, Worker& w) {
    if (trace.adjoint)
        emit_adjoint(trace, batch, first, count, w);
    else
        emit(trace.geometry, trace.species, trace.desorption, trace.key, batch, first, count, w.rays);
    std::vector<Bundle> bundles;
    for (const std::size_t k : trace.active) {
        w.counts[k].emitted += count;
        for (std::uint32_t row = 0; row < count && !trace.adjoint; ++row)
            w.counts[k].ledger.emitted += w.rays.weight[row];
        bundles.push_back({k, w.rays.weight.data(), &trace.sticking[k], &tallies[k], w.bins[k],
                           &w.counts[k].ledger, &w.counts[k]});
    }
    Event event{.batch = batch.number};
    if (bundles.size() > 1) follow_shared(trace, bundles, w, event);
    if (bundles.empty()) return;
    if (only_reemits_diffusely(trace.species))
        follow_neutrals(trace, bundles.front(), w, w.rays, event);
    else
        follow_ions(trace, bundles.front(), w, event, tallies);
}

}  // namespace sidewall::flux
