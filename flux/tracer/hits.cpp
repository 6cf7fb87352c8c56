#include "flux/tracer/hits.hpp"

#include <algorithm>
#include <cmath>

#include "flux/reflection.hpp"
#include "flux/sampling.hpp"
#include "flux/yield.hpp"
#include "surface/ray_scene.hpp"

namespace sidewall::flux {
namespace {

// One hit in double precision.
struct Hit {
    Vec3 point, direction, normal;  // the point is a skin above the surface
    double cosine, energy;
    std::size_t material;
    double theta = 0.0;  // incidence; set where the hit sputters or may reflect
};

Hit hit_of(const Trace& trace, const Rays& r, std::size_t row) {
    const LateralBox& box = trace.geometry.box;
    Hit hit{};
    hit.direction = r.direction(row).normalized();
    hit.point = r.point(row) + static_cast<double>(r.distance[row]) * hit.direction;
    hit.normal = vector_at(r.nx, r.ny, r.nz, row).normalized();
    if (hit.normal.isZero(0.0)) hit.normal = -hit.direction;
    hit.point += trace.geometry.skin * hit.normal;
    for (int axis = 0; axis < 2; ++axis)
        hit.point[axis] = std::clamp(hit.point[axis], box.min[axis], box.max[axis]);
    hit.cosine = std::clamp(-hit.direction.dot(hit.normal), 0.0, 1.0);
    hit.energy = static_cast<double>(r.energy[row]);
    hit.material = trace.materials.empty() ? 0 : static_cast<std::size_t>(trace.materials[r.triangle[row]]);
    return hit;
}

Vec3 reemitted(Reemission kind, const Reflection& reflection, const Hit& hit, Stream& random) {
    switch (kind) {
        case Reemission::specular:
            return mirrored(hit.direction, hit.normal);
        case Reemission::coned:
            return sample_coned(reflection, hit.direction, hit.normal, hit.theta, random);
        case Reemission::diffuse:
            break;
    }
    const double u = random.uniform();
    return sample_lambertian(hit.normal, u, random.uniform());
}

double yield_at(const Trace& trace, const Yield& yield, const Hit& hit) {
    return yield_of(yield, hit.material, trace.species.energy.mean > 0.0, hit.energy, hit.cosine);
}

std::uint64_t weight_of(std::uint64_t weight, double factor) {
    return static_cast<std::uint64_t>(static_cast<double>(weight) * factor + 0.5);
}

// Starts one particle with the weight that a hit of the given weight sputters.
void sputter(const Trace& trace, const Hit& hit, std::uint64_t weight, std::uint32_t triangle,
             std::uint32_t ray, Stream& random, Rays& secondaries, Counts& counts) {
    const Redeposition& re = *trace.species.redeposition;
    const std::uint64_t sputtered = weight_of(weight, yield_at(trace, re.yield, hit));
    if (sputtered == 0) return;
    const std::size_t row = secondaries.count++;
    secondaries.set(row, hit.point, reemitted(re.direction, trace.species.reflection, hit, random));
    secondaries.from[row] = triangle;
    secondaries.ray[row] = ray;
    secondaries.weight[row] = sputtered;
    counts.redeposited.emitted += sputtered;
}

// Cosine of the incidence above which no particle is reflected.
double least_reflected_cosine(const Reflection& reflection) {
    constexpr double kRounding = 1e-9;
    return reflection.to > 0.0 ? std::cos(std::max(0.0, reflection.from - kRounding)) : 1.0;
}

// Draws the energy after a reflection.
double energy_left(const Reflection& reflection, const Hit& hit, Stream& random) {
    const double peak = energy_peak(reflection, hit.theta);
    return sample_truncated_normal(peak * hit.energy, reflection.spread * hit.energy, hit.energy, random);
}

// Calls use(k, words, lane) for the hits k = 0, 1, ... of \p count; the four random words of hit k are
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

// Copies the particle of \p row, but not its weight, to row \p kept, ready for reemit_diffusely.
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

// Prefetches for Tally::add: wedge indices and triangle bin of the hit 24 after the k-th of `count`, wedge
// bins of the hit 8 after it. A macro, because compilers drop calls of functions that only prefetch.
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

// Tallies and absorbs neutrals that stick with probability 1.
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

// Tallies a species' arrivals and subtracts the absorbed part from its weights.
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

// A species' weight on a shared path plays its own roulette below this: it costs more to carry than it adds.
constexpr std::uint64_t kFaintWeight = kOne / 16;

// Plays roulette for each path, then for the species of small weight on it. Survivors move up in the block.
void play_together(const Trace& trace, const Event& event, Worker& w, std::span<Bundle> bundles,
                   std::size_t hits) {
    Rays& r = w.rays;
    const std::uint64_t faint = std::min(kFaintWeight, trace.roulette);  // at most the largest weight
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

// Starts the particles again a skin above the triangle they hit, by Lambert's law about its normal; for a
// triangle without area, about the direction back.
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

// No branches here and in book_misses: they would be mispredicted for half of the particles.
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
        // Move every particle up; the next one overwrites it if it ended.
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

void react_ions(const Trace& trace, Bundle& bundle, Worker& w, const Event& event,
                const std::vector<Tally>& tallies) {
    Rays& r = w.rays;
    const Species& species = trace.species;
    const bool has_energy = species.energy.mean > 0.0;
    const double reflects_below = least_reflected_cosine(species.reflection);
    w.secondaries.count = 0;
    const std::size_t hits = list_hits(r, w.hits);
    book_misses(r, bundle);
    const bool reflected = trace.reflected > 0 && event.bounce > 1;
    std::size_t kept = 0;
    for (std::size_t k = 0; k < hits; ++k) {
        const std::uint32_t row = w.hits[k], triangle = r.triangle[row], ray = r.ray[row];
        const float u = r.u[row], v = r.v[row];
        const std::uint64_t weight = bundle.weight[row];
        Hit hit = hit_of(trace, r, row);
        // Tally.
        const auto tally = [&](std::size_t n, std::uint64_t amount) {
            tallies[n].add(*w.bins[n], triangle, u, v, amount);
            if (reflected)
                tallies[trace.reflected + n].add(*w.bins[trace.reflected + n], triangle, u, v, amount);
        };
        tally(0, weight);
        for (std::size_t y = 0; y < species.yields.size(); ++y)
            tally(1 + y, weight_of(weight, yield_at(trace, species.yields[y], hit)));
        Stream random(trace.key, {ray, event.batch, event.bounce, event.generation});
        const std::uint32_t roulette = random.next();
        // Sputter.
        if (species.redeposition) {
            hit.theta = std::acos(hit.cosine);
            sputter(trace, hit, weight, triangle, ray, random, w.secondaries, *bundle.counts);
        }
        // Stick, or reflect with reduced energy.
        double reflected = 0.0;
        if (!(hit.cosine > reflects_below)) {
            hit.theta = std::acos(hit.cosine);
            reflected = reflection_probability(species.reflection, hit.theta);
        }
        const auto share = static_cast<std::uint64_t>(reflected * static_cast<double>(kOne) + 0.5);
        const std::uint64_t stays = sticking_at(trace, *bundle.sticking, triangle, u, v);
        std::uint64_t rest = part_of(weight - part_of(weight, stays), share);
        double energy = hit.energy;
        if (rest > 0 && has_energy) {
            energy = energy_left(species.reflection, hit, random);
            if (energy < species.stop_energy) rest = 0;
        }
        bundle.ledger->absorbed += weight - rest;
        // Roulette.
        if (rest > 0) rest = play_roulette(rest, trace.roulette, roulette, *bundle.ledger);
        if (rest == 0) continue;
        // Re-emit.
        r.set(kept, hit.point, reemitted(species.reflection.kind, species.reflection, hit, random));
        r.ray[kept] = ray;
        r.from[kept] = triangle;
        bundle.weight[kept] = rest;
        r.energy[kept] = static_cast<float>(energy);
        ++kept;
    }
    bundle.counts->absorbed += hits - kept;
    r.count = kept;
}

}  // namespace sidewall::flux
