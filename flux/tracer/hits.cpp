#include "flux/tracer/hits.hpp"

#include <algorithm>
#include <cmath>

#include "flux/lambert8.hpp"
#include "flux/tracer/gas_collisions.hpp"
#include "flux/tracer/packets.hpp"
#include "surface/ray_scene.hpp"

namespace sidewall::flux {
namespace {

// Long histories must not keep a user waiting who asked to stop.
bool abandoned(const Trace& trace, const Event& event) {
    return event.bounce % 256 == 255 && trace.stop();
}

// Ends particles that may bounce no more: their weight counts as leaked.
void terminate_as_leaked(Rays& r, std::span<Bundle> bundles) {
    for (const Bundle& bundle : bundles)
        for (std::size_t row = 0; row < r.count; ++row) {
            bundle.ledger->leaked += bundle.weight[row];
            if (bundle.counts) bundle.counts->leaked += bundle.weight[row] > 0;
        }
    r.count = 0;
}

}  // namespace

bool fly_on(const Trace& trace, std::span<Bundle> bundles, Rays& rays, Event& event, FlightCounts& flights) {
    if (rays.count == 0 || abandoned(trace, event)) return false;
    if (event.bounce++ == trace.max_bounces) {
        terminate_as_leaked(rays, bundles);
        return false;
    }
    if (std::isfinite(trace.species.mean_free_path)) return fly_through_gas(trace, rays, event, flights);
    fly_block(trace.geometry, rays, flights);
    return true;
}

// Without branches, here and below, which half of the particles would mispredict.
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

}  // namespace sidewall::flux
