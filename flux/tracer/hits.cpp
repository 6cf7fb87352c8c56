#include "flux/tracer/hits.hpp"

#include <algorithm>
#include <cmath>

#include "flux/sampling.hpp"
#include "surface/ray_scene.hpp"

namespace sidewall::flux {
namespace {

// Calls use(k, words, lane) for the hits k = 0, 1, ... of \p count, whose four random words of the event are
// words[0..3][lane].
template <class Use>
inline void for_each_hit(const Trace& trace, const Rays& rays, Column<std::uint32_t>& hits, std::size_t count,
                         const Event& event, const Use& use) {
    std::fill_n(hits.begin() + static_cast<std::ptrdiff_t>(count), kLanes, 0);
    alignas(32) std::uint32_t numbers[kLanes], words[4][kLanes];
    for (std::size_t first = 0; first < count; first += kLanes) {
        for (std::size_t i = 0; i < kLanes; ++i) numbers[i] = rays.ray[hits[first + i]];
        draw8(trace.key, numbers, event, words);
        const std::size_t lanes = std::min(kLanes, count - first);
        for (std::size_t i = 0; i < lanes; ++i) use(first + i, words, i);
    }
}

// Moves the particle of \p row up to \p kept, ready for reemit_diffusely. Not its weight.
inline void move_up(Worker& w, Rays& r, std::size_t kept, std::size_t row, std::uint32_t word1,
                    std::uint32_t word2) {
    r.copy(kept, r, row);
    r.nx[kept] = r.nx[row], r.ny[kept] = r.ny[row], r.nz[kept] = r.nz[row];
    r.distance[kept] = r.distance[row];
    r.ray[kept] = r.ray[row];
    r.from[kept] = r.triangle[row];
    w.word1[kept] = word1;
    w.word2[kept] = word2;
}

// Prefetches for Tally::add: the indices of a hit far ahead of the k-th of `count`, and the bins that those
// of a nearer one name. A macro, because compilers drop calls of functions that do nothing else.
#define SIDEWALL_PREFETCH_BINS(rays, bundle, hits, k, count)                                       \
    do {                                                                                           \
        const std::uint32_t far_triangle = (rays).triangle[(hits)[std::min((k) + 24, (count)-1)]]; \
        const std::uint32_t near_triangle = (rays).triangle[(hits)[std::min((k) + 8, (count)-1)]]; \
        __builtin_prefetch((bundle).tally->wedges_of(far_triangle));                               \
        __builtin_prefetch(&(bundle).bins->triangle[far_triangle], 1);                             \
        const std::uint32_t* near_wedge = (bundle).tally->wedges_of(near_triangle);                \
        for (int corner = 0; corner < 3; ++corner)                                                 \
            __builtin_prefetch(&(bundle).bins->wedge[near_wedge[corner]], 1);                      \
    } while (false)

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

// Tallies a species' arrivals and takes what sticks from its weights.
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

// A species' weight below this plays roulette by itself: it costs more to carry than it is worth.
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

// Sends the particles off from where they hit, a skin above the facet, by Lambert's law about its normal. A
// facet without area sends them back where they came from.
void reemit_diffusely(const Trace& trace, const Worker& w, Rays& r) {
    const auto& box = trace.geometry.box;
    const auto min_x = static_cast<float>(box.min[0]), max_x = static_cast<float>(box.max[0]);
    const auto min_y = static_cast<float>(box.min[1]), max_y = static_cast<float>(box.max[1]);
    const auto skin = static_cast<float>(trace.geometry.skin);
    for (std::size_t first = 0; first < r.count; first += kLanes)
        for (std::size_t i = first; i < first + kLanes; ++i) {
            const float length = std::sqrt(r.nx[i] * r.nx[i] + r.ny[i] * r.ny[i] + r.nz[i] * r.nz[i]);
            const bool flat = length > 0.0f;
            const float inverse = 1.0f / length;
            const float nx = flat ? inverse * r.nx[i] : -r.dx[i], ny = flat ? inverse * r.ny[i] : -r.dy[i],
                        nz = flat ? inverse * r.nz[i] : -r.dz[i];
            const float x = r.x[i] + r.distance[i] * r.dx[i] + skin * nx;
            const float y = r.y[i] + r.distance[i] * r.dy[i] + skin * ny;
            r.x[i] = std::min(std::max(x, min_x), max_x);
            r.y[i] = std::min(std::max(y, min_y), max_y);
            r.z[i] += r.distance[i] * r.dz[i] + skin * nz;
            lambert(nx, ny, nz, unit_float(w.word1[i]), unit_float(w.word2[i]), r.dx[i], r.dy[i], r.dz[i]);
        }
}

}  // namespace

// No branches here and below: half of the particles would mispredict them.
std::size_t list_hits(const Rays& r, Column<std::uint32_t>& hits) {
    std::size_t n = 0;
    for (std::size_t row = 0; row < r.count; ++row) {
        hits[n] = static_cast<std::uint32_t>(row);
        n += (r.triangle[row] != surface::kNoTriangle) & (r.triangle[row] != kLeaked);
    }
    return n;
}

void book_misses(const Rays& r, Bundle& bundle) {
    std::uint64_t escaped = 0, leaked = 0, escapes = 0, leaks = 0, flights = 0;
    for (std::size_t row = 0; row < r.count; ++row) {
        const std::uint64_t weight = bundle.weight[row];
        const bool any = weight > 0, out = r.triangle[row] == surface::kNoTriangle,
                   lost = r.triangle[row] == kLeaked;
        escaped += out ? weight : 0;
        leaked += lost ? weight : 0;
        escapes += any & out;
        leaks += any & lost;
        flights += any;
    }
    bundle.ledger->escaped += escaped;
    bundle.ledger->leaked += leaked;
    bundle.arrived = flights - escapes - leaks;
    if (!bundle.counts) return;
    bundle.counts->escaped += escapes;
    bundle.counts->leaked += leaks;
    bundle.counts->arrivals += bundle.arrived;
}

void react_neutrals(const Trace& trace, Bundle& bundle, Worker& w, Rays& r, const Event& event) {
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

void react_shared(const Trace& trace, std::span<Bundle> bundles, Worker& w, const Event& event) {
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
