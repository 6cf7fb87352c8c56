#include "flux/history.hpp"

#include <algorithm>
#include <cmath>

#include "flux/lambert8.hpp"
#include "flux/reflection.hpp"
#include "flux/scatter.hpp"
#include "flux/several.hpp"
#include "flux/yield.hpp"

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

// Particles of one generation in flight, and where their weight is booked.
struct Flock {
    Rays& rays;
    Counts& counts;
    Ledger& ledger;
    const Sticking& sticking;
    const Tally& tally;
    Tally::Bins& bins;
    Event event;  // batch, bounce and generation of the next hit
    bool primary;
};

// The weight goes on as it is, or plays for a whole one with 28 random bits. \returns 0 if it lost.
std::uint64_t play_roulette(std::uint64_t weight, std::uint64_t threshold, std::uint32_t word,
                            Ledger& ledger) {
    const bool safe = weight >= threshold, wins = (word >> 4) < weight;
    ledger.gained += !safe & wins ? kOne - weight : 0;
    ledger.lost += !safe & !wins ? weight : 0;
    return safe ? weight : wins ? kOne : 0;
}

// Books the particles that hit nothing, and lists the rows of the others. Without branches, which half of the
// particles would mispredict.
std::size_t list_landed(const Flock& flock, Column<std::uint32_t>& landed) {
    const Rays& r = flock.rays;
    std::uint64_t escaped = 0, leaked = 0, escapes = 0, leaks = 0;
    std::size_t n = 0;
    for (std::size_t row = 0; row < r.count; ++row) {
        const bool out = r.triangle[row] == surface::kNoTriangle, lost = r.triangle[row] == kLeaked;
        escaped += out ? r.weight[row] : 0;
        leaked += lost ? r.weight[row] : 0;
        escapes += out;
        leaks += lost;
        landed[n] = static_cast<std::uint32_t>(row);
        n += !(out | lost);
    }
    flock.ledger.escaped += escaped;
    flock.ledger.leaked += leaked;
    if (flock.primary) {
        flock.counts.escaped += escapes;
        flock.counts.leaked += leaks;
        flock.counts.arrivals += n;
    }
    return n;
}

// Neutrals that all stick.
void absorb_all(Flock& flock, Worker& w, std::size_t landed) {
    const Rays& r = flock.rays;
    for (std::size_t k = 0; k < landed; ++k) {
        SIDEWALL_PREFETCH_BINS(r, flock.tally, flock.bins, w.landed[std::min(k + 24, landed - 1)],
                               w.landed[std::min(k + 8, landed - 1)]);
        const std::uint32_t row = w.landed[k];
        flock.tally.add(flock.bins, r.triangle[row], r.u[row], r.v[row], r.weight[row]);
        flock.ledger.absorbed += r.weight[row];
    }
    if (flock.primary) flock.counts.absorbed += landed;
    flock.rays.count = 0;
}

// Neutrals without yields: tally, absorb, re-emit. Survivors move up in the block.
void scatter_neutrals(const Trace& trace, Flock& flock, Worker& w) {
    Rays& r = flock.rays;
    const std::size_t landed = list_landed(flock, w.landed);
    const Sticking& sticking = flock.sticking;
    if (sticking.by_wedge.empty() && sticking.by_triangle.size() == 1 && sticking.by_triangle[0] == kOne)
        return absorb_all(flock, w, landed);
    std::fill_n(w.landed.begin() + static_cast<std::ptrdiff_t>(landed), kLanes, 0);
    std::size_t kept = 0;
    alignas(32) std::uint32_t rays[kLanes], words[4][kLanes];
    for (std::size_t first = 0; first < landed; first += kLanes) {
        for (std::size_t i = 0; i < kLanes; ++i) rays[i] = r.ray[w.landed[first + i]];
        draw8(trace.key, rays, flock.event, words);
        const std::size_t lanes = std::min(kLanes, landed - first);
        for (std::size_t i = 0; i < lanes; ++i) {
            const std::size_t k = first + i;
            SIDEWALL_PREFETCH_BINS(r, flock.tally, flock.bins, w.landed[std::min(k + 24, landed - 1)],
                                   w.landed[std::min(k + 8, landed - 1)]);
            const std::uint32_t row = w.landed[k];
            const std::uint32_t triangle = r.triangle[row];
            const std::uint64_t weight = r.weight[row];
            flock.tally.add(flock.bins, triangle, r.u[row], r.v[row], weight);
            const std::uint64_t absorbed =
                part_of(weight, sticking_at(trace, sticking, triangle, r.u[row], r.v[row]));
            flock.ledger.absorbed += absorbed;
            const std::uint64_t rest =
                play_roulette(weight - absorbed, trace.roulette, words[0][i], flock.ledger);
            // Every particle is moved up; those that ended are written over.
            move_up(w, r, kept, row, words[1][i], words[2][i]);
            r.weight[kept] = rest;
            kept += rest > 0;
        }
    }
    if (flock.primary) flock.counts.absorbed += landed - kept;
    r.count = kept;
    scatter_diffusely(trace, w, r);
}

// One hit in double precision, as ions need it.
struct Hit {
    Vec3 point, direction, normal;  // the point a skin off the surface
    double theta, cosine, energy;
    std::size_t material;
};

Hit hit_of(const Trace& trace, const Rays& r, std::size_t row) {
    const auto wide = [](float a, float b, float c) {
        return Vec3(static_cast<double>(a), static_cast<double>(b), static_cast<double>(c));
    };
    Hit hit;
    hit.direction = wide(r.dx[row], r.dy[row], r.dz[row]).normalized();
    hit.point = wide(r.x[row], r.y[row], r.z[row]) + static_cast<double>(r.distance[row]) * hit.direction;
    hit.normal = wide(r.nx[row], r.ny[row], r.nz[row]).normalized();
    if (hit.normal.isZero(0.0)) hit.normal = -hit.direction;
    hit.point += trace.stage.skin * hit.normal;
    for (int axis = 0; axis < 2; ++axis)
        hit.point[axis] = std::clamp(hit.point[axis], trace.stage.box.min[axis], trace.stage.box.max[axis]);
    hit.cosine = std::clamp(-hit.direction.dot(hit.normal), 0.0, 1.0);
    hit.theta = std::acos(hit.cosine);
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

void send_off(Rays& r, std::size_t row, const Hit& hit, const Vec3& direction) {
    r.x[row] = static_cast<float>(hit.point.x());
    r.y[row] = static_cast<float>(hit.point.y());
    r.z[row] = static_cast<float>(hit.point.z());
    r.dx[row] = static_cast<float>(direction.x());
    r.dy[row] = static_cast<float>(direction.y());
    r.dz[row] = static_cast<float>(direction.z());
}

std::uint64_t weight_of(std::uint64_t weight, double factor) {
    return static_cast<std::uint64_t>(static_cast<double>(weight) * factor + 0.5);
}

// Any particle. Survivors move up in the block; what hits sputter goes to w.spawned.
void scatter_any(const Trace& trace, Flock& flock, Worker& w, const std::vector<Tally>& tallies) {
    Rays& r = flock.rays;
    const Species& species = trace.species;
    const bool has_energy = species.energy.mean > 0.0;
    w.spawned.count = 0;
    const std::size_t landed = list_landed(flock, w.landed);
    std::size_t kept = 0;
    for (std::size_t k = 0; k < landed; ++k) {
        const std::uint32_t row = w.landed[k], triangle = r.triangle[row];
        const float u = r.u[row], v = r.v[row];
        const std::uint64_t weight = r.weight[row];
        const Hit hit = hit_of(trace, r, row);
        flock.tally.add(flock.bins, triangle, u, v, weight);
        for (std::size_t y = 0; y < species.yields.size(); ++y) {
            const double yield =
                yield_of(species.yields[y], hit.material, has_energy, hit.energy, hit.cosine);
            tallies[1 + y].add(*w.bins[1 + y], triangle, u, v, weight_of(weight, yield));
        }
        Event event = flock.event;
        event.ray = r.ray[row];
        Stream random(trace.key, event);
        const std::uint32_t roulette = random.next();
        if (species.redeposition) {
            const Redeposition& re = *species.redeposition;
            const std::uint64_t sputtered =
                weight_of(weight, yield_of(re.yield, hit.material, has_energy, hit.energy, hit.cosine));
            if (sputtered > 0) {
                Rays& s = w.spawned;
                send_off(s, s.count, hit, reemitted(re.direction, species.reflection, hit, random));
                s.from[s.count] = triangle;
                s.ray[s.count] = event.ray;
                s.weight[s.count++] = sputtered;
                flock.counts.redeposited.emitted += sputtered;
            }
        }
        const double reflected = reflection_probability(species.reflection, hit.theta);
        const auto share = static_cast<std::uint64_t>(reflected * static_cast<double>(kOne) + 0.5);
        const std::uint64_t stays = sticking_at(trace, flock.sticking, triangle, u, v);
        std::uint64_t rest = part_of(weight - part_of(weight, stays), share);
        double energy = hit.energy;
        if (rest > 0 && has_energy) {
            const double peak = energy_peak(species.reflection, hit.theta);
            energy =
                sample_truncated_normal(peak * energy, species.reflection.spread * energy, energy, random);
            if (energy < species.stop_energy) rest = 0;
        }
        flock.ledger.absorbed += weight - rest;
        if (rest > 0) rest = play_roulette(rest, trace.roulette, roulette, flock.ledger);
        if (rest == 0) continue;
        send_off(r, kept, hit, reemitted(species.reflection.kind, species.reflection, hit, random));
        r.ray[kept] = event.ray;
        r.from[kept] = triangle;
        r.weight[kept] = rest;
        r.energy[kept] = static_cast<float>(energy);
        ++kept;
    }
    flock.counts.absorbed += landed - kept;
    r.count = kept;
}

// Those that never end have leaked, by decree.
void give_up(Flock& flock) {
    for (std::size_t row = 0; row < flock.rays.count; ++row) flock.ledger.leaked += flock.rays.weight[row];
    if (flock.primary) flock.counts.leaked += flock.rays.count;
    flock.rays.count = 0;
}

// Neutrals of any generation, hit after hit.
void follow_neutrals(const Trace& trace, Flock flock, Worker& w) {
    while (flock.rays.count > 0 && !abandoned(trace, flock.event)) {
        if (flock.event.bounce++ == trace.max_bounces) return give_up(flock);
        fly_block(trace.stage, flock.rays, w.flights);
        scatter_neutrals(trace, flock, w);
    }
}

}  // namespace

void scatter_diffusely(const Trace& trace, const Worker& w, Rays& r) {
    const auto& box = trace.stage.box;
    const auto min_x = static_cast<float>(box.min[0]), max_x = static_cast<float>(box.max[0]);
    const auto min_y = static_cast<float>(box.min[1]), max_y = static_cast<float>(box.max[1]);
    const auto skin = static_cast<float>(trace.stage.skin);
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

void Counts::add(const Counts& other) {
    emitted += other.emitted;
    absorbed += other.absorbed;
    escaped += other.escaped;
    leaked += other.leaked;
    arrivals += other.arrivals;
    flux::add(ledger, other.ledger);
    flux::add(redeposited, other.redeposited);
}

void trace_block(const Trace& trace, const Batch& batch, std::uint32_t first, std::uint32_t count,
                 const std::vector<Tally>& tallies, Worker& w) {
    emit(trace.stage, trace.species, trace.key, batch, first, count, w.rays);
    for (const std::size_t k : trace.riding) {
        w.counts[k].emitted += count;
        w.counts[k].ledger.emitted += count * kOne;
    }
    Left only{trace.riding.front(), {.batch = batch.number}};
    if (trace.riding.size() > 1) {
        const std::optional<Left> left = follow_together(trace, batch, tallies, w);
        if (!left) return;
        only = *left;
    }
    const std::size_t k = only.species;
    Counts& counts = w.counts[k];
    Flock flock{w.rays, counts, counts.ledger, trace.sticking[k], tallies[k], *w.bins[k], only.event, true};
    if (goes_on_diffusely(trace.species)) return follow_neutrals(trace, flock, w);
    while (flock.rays.count > 0 && !abandoned(trace, flock.event)) {
        if (flock.event.bounce++ == trace.max_bounces) return give_up(flock);
        fly_block(trace.stage, flock.rays, w.flights);
        scatter_any(trace, flock, w, tallies);
        if (w.spawned.count == 0) continue;
        follow_neutrals(trace,
                        {w.spawned,
                         counts,
                         counts.redeposited,
                         trace.redeposition,
                         tallies.back(),
                         *w.bins.back(),
                         {.batch = batch.number, .bounce = 0, .generation = flock.event.bounce},
                         false},
                        w);
    }
}

}  // namespace sidewall::flux
