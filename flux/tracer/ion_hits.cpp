#include "flux/tracer/ion_hits.hpp"

#include <algorithm>
#include <cmath>

#include "flux/reflection.hpp"
#include "flux/sampling.hpp"
#include "flux/tracer/hits.hpp"
#include "flux/yield.hpp"

namespace sidewall::flux {
namespace {

// One hit in double precision.
struct Hit {
    Vec3 point, direction, normal;  // the point a skin off the surface
    double cosine, energy;
    std::size_t material;
    double theta = 0.0;  // set once asked for
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

// Starts the particles that a hit of the given weight sputters.
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

// The cosine of the incidence above which no particle is reflected.
double least_reflected_cosine(const Reflection& reflection) {
    constexpr double kRounding = 1e-9;
    return reflection.to > 0.0 ? std::cos(std::max(0.0, reflection.from - kRounding)) : 1.0;
}

// Energy after a reflection.
double energy_left(const Reflection& reflection, const Hit& hit, Stream& random) {
    const double peak = energy_peak(reflection, hit.theta);
    return sample_truncated_normal(peak * hit.energy, reflection.spread * hit.energy, hit.energy, random);
}

}  // namespace

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
        if (species.redeposition)
            sputter(trace, hit, weight, triangle, ray, random, w.secondaries, *bundle.counts);
        // Stick, or reflect with what energy is left.
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
