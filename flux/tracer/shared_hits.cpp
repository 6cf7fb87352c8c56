#include "flux/tracer/shared_hits.hpp"

#include <algorithm>

namespace sidewall::flux {
namespace {

// Tallies a species' arrivals and leaves in its weights what does not stick.
void arrive(const Trace& trace, const Worker& w, Bundle& bundle, std::size_t hits) {
    const Rays& r = w.rays;
    std::uint64_t absorbed = 0;
    for (std::size_t k = 0; k < hits; ++k) {
        SIDEWALL_PREFETCH_BINS(r, bundle, w.hits, k, hits);
        const std::uint32_t row = w.hits[k], triangle = r.triangle[row];
        const std::uint64_t weight = bundle.weight[row];
        if (weight == 0) continue;
        bundle.tally->add(*bundle.bins, triangle, r.u[row], r.v[row], weight);
        const std::uint64_t stays =
            part_of(weight, sticking_at(trace, *bundle.sticking, triangle, r.u[row], r.v[row]));
        absorbed += stays;
        bundle.weight[row] = weight - stays;
    }
    bundle.ledger->absorbed += absorbed;
}

// Below this a weight costs more to carry than it tells.
constexpr std::uint64_t kFaintWeight = kOne / 16;

// Roulette by the path, then by the species that are faint on it. Survivors move up in the block.
void play_together(const Trace& trace, const Event& event, Worker& w, std::span<Bundle> bundles,
                   std::size_t hits) {
    Rays& r = w.rays;
    const std::uint64_t faint = std::min(kFaintWeight, trace.roulette);  // so never the largest weight
    std::size_t kept = 0;
    for_each_hit(trace, r, w.hits, hits, event, [&](std::size_t k, const auto& words, std::size_t lane) {
        const std::uint32_t row = w.hits[k];
        std::uint64_t largest = 0;
        for (const Bundle& bundle : bundles) largest = std::max(largest, bundle.weight[row]);
        const bool safe = largest >= trace.roulette, goes_on = safe | ((words[0][lane] >> 4) < largest);
        const double scale =
            safe ? 1.0 : static_cast<double>(kOne) / static_cast<double>(std::max<std::uint64_t>(1, largest));
        for (Bundle& bundle : bundles) {
            const std::uint64_t weight = bundle.weight[row];
            const auto scaled = static_cast<std::uint64_t>(static_cast<double>(weight) * scale + 0.5);
            // Survives with probability scaled / faint.
            const bool wins = (words[3][lane] >> 4) * faint < scaled << 28;
            const std::uint64_t next = !goes_on ? 0 : scaled >= faint ? scaled : wins ? faint : 0;
            bundle.ledger->gained += next > weight ? next - weight : 0;
            bundle.ledger->lost += next < weight ? weight - next : 0;
            bundle.weight[kept] = next;
            bundle.survived += next > 0;
        }
        move_up(w, r, kept, row, words[1][lane], words[2][lane]);
        kept += goes_on;
    });
    r.count = kept;
}

}  // namespace

void hit_shared(const Trace& trace, std::span<Bundle> bundles, Worker& w, const Event& event) {
    const std::size_t hits = list_hits(w.rays, w.hits);
    for (Bundle& bundle : bundles) {
        book_misses(w.rays, bundle);
        arrive(trace, w, bundle, hits);
        bundle.survived = 0;
    }
    play_together(trace, event, w, bundles, hits);
    for (Bundle& bundle : bundles) bundle.counts->absorbed += bundle.arrived - bundle.survived;
    reemit_diffusely(trace, w, w.rays);
}

}  // namespace sidewall::flux
