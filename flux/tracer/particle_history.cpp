// A particle's life, a block of kBlock particles at a time:
//
//     emit        a point of the source plane, or of a surface that desorbs,          source.cpp
//                 a direction, an energy
//                 or, bottom-up, what a look from the surface sees arrive              looks.cpp
//     fly         to the next hit, through side planes on the way (lateral.hpp)       packets.cpp
//                 one by one where rounding matters                                   flight.cpp
//                 with collisions on the way, if the species has a mean free path     gas.cpp
//     hit         one of three kinds, by what the species does at the surface:
//       neutrals    stick, or are re-emitted diffusely                                neutral_hits.cpp
//       ions        and whatever has energy, yields, reflection or redeposition       ion_hits.cpp
//       shared      neutrals of several species on the same paths                     shared_hits.cpp
//     and at every hit, in this order:
//       miss        what escaped or leaked is booked; that was its end                hits.cpp
//       tally       its weight, times each yield, to triangle and wedges              tally.hpp, yield.hpp
//       sputter     secondary particles, which then live from `fly` on as neutrals    ion_hits.cpp
//       stick       part of its weight is absorbed                                    hits.hpp, sticking_at
//       roulette    a small rest ends, or goes on as a whole particle                 hits.hpp, play_roulette
//       go on       mirrored or in a cone: back to `fly`                              reflection.hpp
//                   by Lambert's law: back to `fly`                                   lambert8.hpp
//
// A life ends absorbed, escaped or leaked; every weight is booked in a Ledger, which balances to the last
// bit. Random numbers are named by seed, time step, species, batch, ray, bounce and generation: random.hpp.
// Who hands out the blocks and sums up what they count: tracer.cpp.
#include "flux/tracer/particle_history.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <vector>

#include "flux/tracer/adjoint.hpp"
#include "flux/tracer/hits.hpp"
#include "flux/tracer/ion_hits.hpp"
#include "flux/tracer/neutral_hits.hpp"
#include "flux/tracer/shared_hits.hpp"

namespace sidewall::flux {
namespace {

void add(Ledger& a, const Ledger& b) {
    a.emitted += b.emitted;
    a.gained += b.gained;
    a.lost += b.lost;
    a.absorbed += b.absorbed;
    a.escaped += b.escaped;
    a.leaked += b.leaked;
}

// To the next hit; what was looked for has arrived at its first one.
bool reach_hit(const Trace& trace, Bundle& bundle, Rays& rays, Event& event, FlightCounts& flights) {
    if (!trace.bottom_up || event.bounce > 0 || event.generation > 0)
        return fly_on(trace, {&bundle, 1}, rays, event, flights);
    ++event.bounce;
    return rays.count > 0;
}

// Neutrals, hit after hit. They are w.rays, or what ions sputtered.
void follow_neutrals(const Trace& trace, Bundle bundle, Worker& w, Rays& rays, Event event) {
    while (reach_hit(trace, bundle, rays, event, w.flights)) hit_neutrals(trace, bundle, w, rays, event);
}

// Ions, hit after hit; after each, what it sputtered lives to its end.
void follow_ions(const Trace& trace, Bundle bundle, Worker& w, Event event,
                 const std::vector<Tally>& tallies) {
    while (reach_hit(trace, bundle, w.rays, event, w.flights)) {
        hit_ions(trace, bundle, w, event, tallies);
        if (w.secondaries.count == 0) continue;
        const Bundle sputtered{bundle.species,
                               w.secondaries.weight.data(),
                               &trace.redeposition,
                               &tallies.back(),
                               w.bins.back(),
                               &bundle.counts->redeposited,
                               nullptr};
        follow_neutrals(trace, sputtered, w, w.secondaries,
                        {.batch = event.batch, .bounce = 0, .generation = event.bounce});
    }
}

// Species on the same paths, hit after hit. Those that have stuck altogether drop out of \p bundles. When one
// is left alone, returns with its weights in w.rays and \p event its last hit: following it alone is faster.
void follow_shared(const Trace& trace, std::vector<Bundle>& bundles, Worker& w, Event& event) {
    for (Bundle& bundle : bundles) {
        bundle.weight = w.weights[bundle.species].data();
        std::fill_n(bundle.weight, w.rays.count, kOne);
    }
    while (fly_on(trace, bundles, w.rays, event, w.flights)) {
        hit_shared(trace, bundles, w, event);
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

void Counts::add(const Counts& other) {
    emitted += other.emitted;
    absorbed += other.absorbed;
    escaped += other.escaped;
    leaked += other.leaked;
    arrivals += other.arrivals;
    flux::add(ledger, other.ledger);
    flux::add(redeposited, other.redeposited);
}

void PassCounts::add(const PassCounts& other) {
    for (std::size_t k = 0; k < species.size(); ++k) species[k].add(other.species[k]);
    flights.segments += other.flights.segments;
    flights.rescued += other.flights.rescued;
}

namespace {

// Counts and FlightCounts are words alone.
template <class T>
using Words = std::array<std::uint64_t, sizeof(T) / sizeof(std::uint64_t)>;

template <class T>
void write_words(const T& counts, std::vector<std::uint64_t>& words) {
    const auto own = std::bit_cast<Words<T>>(counts);
    words.insert(words.end(), own.begin(), own.end());
}

template <class T>
void read_words(T& counts, std::span<std::uint64_t>& words) {
    Words<T> own;
    std::copy_n(words.begin(), own.size(), own.begin());
    counts = std::bit_cast<T>(own);
    words = words.subspan(own.size());
}

}  // namespace

void PassCounts::write(std::vector<std::uint64_t>& words) const {
    for (const Counts& counts : species) write_words(counts, words);
    write_words(flights, words);
}

void PassCounts::read(std::span<std::uint64_t>& words) {
    for (Counts& counts : species) read_words(counts, words);
    read_words(flights, words);
}

void trace_block(const Trace& trace, const Batch& batch, std::uint32_t first, std::uint32_t count,
                 const std::vector<Tally>& tallies, Worker& w) {
    if (trace.bottom_up)
        look(trace, batch, first, count, w);
    else
        emit(trace.geometry, trace.species, trace.desorption, trace.key, batch, first, count, w.rays);
    std::vector<Bundle> bundles;
    for (const std::size_t k : trace.active) {
        w.counts[k].emitted += count;
        if (!trace.bottom_up) w.counts[k].ledger.emitted += count * kOne;
        bundles.push_back({k, w.rays.weight.data(), &trace.sticking[k], &tallies[k], w.bins[k],
                           &w.counts[k].ledger, &w.counts[k]});
    }
    Event event{.batch = batch.number};
    if (bundles.size() > 1) follow_shared(trace, bundles, w, event);
    if (bundles.empty()) return;
    if (goes_on_diffusely(trace.species))
        follow_neutrals(trace, bundles.front(), w, w.rays, event);
    else
        follow_ions(trace, bundles.front(), w, event, tallies);
}

}  // namespace sidewall::flux
