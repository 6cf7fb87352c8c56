#include "flux/tracer/neutral_hits.hpp"

#include <algorithm>

#include "flux/tracer/hits.hpp"

namespace sidewall::flux {
namespace {

// The end of neutrals that all stick.
void absorb_all(Bundle& bundle, Worker& w, Rays& r, std::size_t hits) {
    for (std::size_t k = 0; k < hits; ++k) {
        SIDEWALL_PREFETCH_BINS(r, bundle, w.hits, k, hits);
        const std::uint32_t row = w.hits[k];
        bundle.tally->add(*bundle.bins, r.triangle[row], r.u[row], r.v[row], bundle.weight[row]);
        bundle.ledger->absorbed += bundle.weight[row];
    }
    if (bundle.counts) bundle.counts->absorbed += hits;
    r.count = 0;
}

}  // namespace

void hit_neutrals(const Trace& trace, Bundle& bundle, Worker& w, Rays& r, const Event& event) {
    const std::size_t hits = list_hits(r, w.hits);
    book_misses(r, bundle);
    const Sticking& sticking = *bundle.sticking;
    if (sticking.by_wedge.empty() && sticking.by_triangle.size() == 1 && sticking.by_triangle[0] == kOne)
        return absorb_all(bundle, w, r, hits);
    std::size_t kept = 0;
    for_each_hit(trace, r, w.hits, hits, event, [&](std::size_t k, const auto& words, std::size_t lane) {
        SIDEWALL_PREFETCH_BINS(r, bundle, w.hits, k, hits);
        const std::uint32_t row = w.hits[k];
        const std::uint32_t triangle = r.triangle[row];
        const std::uint64_t weight = bundle.weight[row];
        bundle.tally->add(*bundle.bins, triangle, r.u[row], r.v[row], weight);
        const std::uint64_t absorbed =
            part_of(weight, sticking_at(trace, sticking, triangle, r.u[row], r.v[row]));
        bundle.ledger->absorbed += absorbed;
        const std::uint64_t rest =
            play_roulette(weight - absorbed, trace.roulette, words[0][lane], *bundle.ledger);
        // Every particle is moved up; those that ended are written over.
        move_up(w, r, kept, row, words[1][lane], words[2][lane]);
        bundle.weight[kept] = rest;
        kept += rest > 0;
    });
    if (bundle.counts) bundle.counts->absorbed += hits - kept;
    r.count = kept;
    reemit_diffusely(trace, w, r);
}

}  // namespace sidewall::flux
