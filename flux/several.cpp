#include "flux/several.hpp"

#include <algorithm>
#include <vector>

#include "flux/scatter.hpp"

namespace sidewall::flux {
namespace {

// A species on the paths of a block.
struct Rider {
    std::size_t species;
    std::uint64_t* weight;  // by row
    const Sticking* sticking;
    const Tally* tally;
    Tally::Bins* bins;
    Counts* counts;
    std::uint64_t arrived = 0;  // hits of this bounce with any of its weight
    std::uint64_t kept = 0;     // paths that go on with any of it
};
using Riders = std::vector<Rider>;

// Lists the rows that hit something.
std::size_t list_landed(const Rays& r, Column<std::uint32_t>& landed) {
    std::size_t n = 0;
    for (std::size_t row = 0; row < r.count; ++row) {
        landed[n] = static_cast<std::uint32_t>(row);
        n += (r.triangle[row] != surface::kNoTriangle) & (r.triangle[row] != kLeaked);
    }
    return n;
}

// Books what a species loses with the paths that hit nothing, and counts its arrivals.
void book_flights(const Rays& r, Rider& rider) {
    std::uint64_t escaped = 0, leaked = 0, escapes = 0, leaks = 0, flights = 0;
    for (std::size_t row = 0; row < r.count; ++row) {
        const std::uint64_t weight = rider.weight[row];
        const bool any = weight > 0, out = r.triangle[row] == surface::kNoTriangle,
                   lost = r.triangle[row] == kLeaked;
        escaped += out ? weight : 0;
        leaked += lost ? weight : 0;
        escapes += any & out;
        leaks += any & lost;
        flights += any;
    }
    rider.counts->ledger.escaped += escaped;
    rider.counts->ledger.leaked += leaked;
    rider.counts->escaped += escapes;
    rider.counts->leaked += leaks;
    rider.arrived = flights - escapes - leaks;
    rider.counts->arrivals += rider.arrived;
}

// Tallies a species' arrivals and leaves in its weights what does not stick.
void arrive(const Trace& trace, const Worker& w, Rider& rider, std::size_t landed) {
    const Rays& r = w.rays;
    std::uint64_t absorbed = 0;
    for (std::size_t k = 0; k < landed; ++k) {
        SIDEWALL_PREFETCH_BINS(r, *rider.tally, *rider.bins, w.landed[std::min(k + 24, landed - 1)],
                               w.landed[std::min(k + 8, landed - 1)]);
        const std::uint32_t row = w.landed[k], triangle = r.triangle[row];
        const std::uint64_t weight = rider.weight[row];
        if (weight == 0) continue;
        rider.tally->add(*rider.bins, triangle, r.u[row], r.v[row], weight);
        const std::uint64_t stays =
            part_of(weight, sticking_at(trace, *rider.sticking, triangle, r.u[row], r.v[row]));
        absorbed += stays;
        rider.weight[row] = weight - stays;
    }
    rider.counts->ledger.absorbed += absorbed;
}

// Below this a weight costs more to carry than it tells.
constexpr std::uint64_t kFaint = kOne / 16;

// Roulette by the path, then by the species that are faint on it. Survivors move up in the block.
void play_together(const Trace& trace, const Event& event, Worker& w, Riders& riders, std::size_t landed) {
    Rays& r = w.rays;
    const std::uint64_t faint = std::min(kFaint, trace.roulette);  // so never the largest weight
    std::fill_n(w.landed.begin() + static_cast<std::ptrdiff_t>(landed), kLanes, 0);
    std::size_t kept = 0;
    alignas(32) std::uint32_t rays[kLanes], words[4][kLanes];
    for (std::size_t first = 0; first < landed; first += kLanes) {
        for (std::size_t i = 0; i < kLanes; ++i) rays[i] = r.ray[w.landed[first + i]];
        draw8(trace.key, rays, event, words);
        const std::size_t lanes = std::min(kLanes, landed - first);
        for (std::size_t i = 0; i < lanes; ++i) {
            const std::uint32_t row = w.landed[first + i];
            std::uint64_t largest = 0;
            for (const Rider& rider : riders) largest = std::max(largest, rider.weight[row]);
            const bool safe = largest >= trace.roulette, goes_on = safe | ((words[0][i] >> 4) < largest);
            const double scale =
                safe ? 1.0
                     : static_cast<double>(kOne) / static_cast<double>(std::max<std::uint64_t>(1, largest));
            for (Rider& rider : riders) {
                const std::uint64_t weight = rider.weight[row];
                const auto scaled = static_cast<std::uint64_t>(static_cast<double>(weight) * scale + 0.5);
                // Survives with probability scaled / faint.
                const bool wins = (words[3][i] >> 4) * faint < scaled << 28;
                const std::uint64_t next = !goes_on ? 0 : scaled >= faint ? scaled : wins ? faint : 0;
                rider.counts->ledger.gained += next > weight ? next - weight : 0;
                rider.counts->ledger.lost += next < weight ? weight - next : 0;
                rider.weight[kept] = next;
                rider.kept += next > 0;
            }
            move_up(w, r, kept, row, words[1][i], words[2][i]);
            kept += goes_on;
        }
    }
    r.count = kept;
}

// Those that never end have leaked, by decree.
void give_up(Rays& r, const Riders& riders) {
    for (const Rider& rider : riders)
        for (std::size_t row = 0; row < r.count; ++row) {
            rider.counts->ledger.leaked += rider.weight[row];
            rider.counts->leaked += rider.weight[row] > 0;
        }
    r.count = 0;
}

}  // namespace

std::optional<Left> follow_together(const Trace& trace, const Batch& batch, const std::vector<Tally>& tallies,
                                    Worker& w) {
    Riders riders;
    for (const std::size_t k : trace.riding) {
        std::fill_n(w.weights[k].begin(), w.rays.count, kOne);
        riders.push_back({k, w.weights[k].data(), &trace.sticking[k], &tallies[k], w.bins[k], &w.counts[k]});
    }
    Event event{.batch = batch.number};
    while (w.rays.count > 0 && !abandoned(trace, event)) {
        if (event.bounce++ == trace.max_bounces) {
            give_up(w.rays, riders);
            break;
        }
        fly_block(trace.stage, w.rays, w.flights);
        const std::size_t landed = list_landed(w.rays, w.landed);
        for (Rider& rider : riders) {
            book_flights(w.rays, rider);
            arrive(trace, w, rider, landed);
            rider.kept = 0;
        }
        play_together(trace, event, w, riders, landed);
        for (Rider& rider : riders) rider.counts->absorbed += rider.arrived - rider.kept;
        scatter_diffusely(trace, w, w.rays);
        // Species that have stuck altogether ride no further.
        std::erase_if(riders, [](const Rider& rider) { return rider.kept == 0; });
        if (riders.size() == 1) {
            std::copy_n(riders.front().weight, w.rays.count, w.rays.weight.begin());
            return Left{riders.front().species, event};
        }
    }
    return std::nullopt;
}

}  // namespace sidewall::flux
