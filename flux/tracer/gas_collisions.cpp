#include "flux/tracer/gas_collisions.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace sidewall::flux {
namespace {

// Key of the free paths' random numbers; other than that of hits. Species with collisions sputter nothing, so
// that the generation is free to count collisions.
RandomKey gas_key(RandomKey key) {
    const auto mixed = r123::Philox4x32{}({{key[0], key[1], 0u, 0u}}, {{0x6a5c0111u, 0xf10cu}});
    return {{mixed[0], mixed[1]}};
}

// Folds a coordinate of a straight path into [low, high], by mirroring or wrapping at the sides.
double folded(double at, double low, double high, Boundary boundary) {
    const double width = high - low;
    double offset = at - low;
    if (boundary == Boundary::periodic) {
        offset -= width * std::floor(offset / width);
    } else if (boundary == Boundary::reflective) {
        offset -= 2.0 * width * std::floor(offset / (2.0 * width));
        if (offset > width) offset = 2.0 * width - offset;
    }
    return std::clamp(low + offset, low, high);
}

// Particles of a block that are still in flight between two hits.
struct UnderWay {
    Rays rays;
    Column<std::uint32_t> home;  // row in the block
    FlightStarts begun;
    Column<float> free_path;
    alignas(32) std::uint32_t words[4][kBlock + kLanes];  // random numbers of each flight
};

void begin(const Rays& rays, UnderWay& under_way) {
    under_way.rays.count = rays.count;
    for (std::size_t row = 0; row < rays.count; ++row) {
        under_way.rays.copy(row, rays, row);
        under_way.rays.from[row] = rays.from[row];
        under_way.rays.ray[row] = rays.ray[row];
        under_way.home[row] = static_cast<std::uint32_t>(row);
    }
}

void draw_paths(RandomKey key, double mean, Event event, std::uint32_t collision, UnderWay& under_way) {
    const Rays& rays = under_way.rays;
    event.generation = collision;
    alignas(32) std::uint32_t words[4][kLanes];
    for (std::size_t first = 0; first < rays.count; first += kLanes) {
        draw8(key, &rays.ray[first], event, words);
        for (std::size_t w = 0; w < 4; ++w) std::copy_n(words[w], kLanes, &under_way.words[w][first]);
    }
    for (std::size_t row = 0; row < rays.count; ++row) {
        under_way.begun.copy(row, rays, row);
        under_way.free_path[row] = static_cast<float>(-mean * std::log(unit_double(under_way.words[0][row])));
    }
}

// Gives the particle that collided in `row` its new position and direction, and stores it in row `kept`.
void collide(const Geometry& geometry, std::size_t row, std::size_t kept, UnderWay& u) {
    const LateralBox& box = geometry.box;
    const double path = static_cast<double>(u.free_path[row]);
    const Vec3 start = u.begun.point(row), way = u.begun.direction(row);
    const double x = start.x() + path * way.x();
    const double y = start.y() + (geometry.straight ? 0.0 : path * way.y());
    Rays& r = u.rays;
    const Vec3 place = geometry.revolution ? r.point(row)
                                           : Vec3(folded(x, box.min[0], box.max[0], box.boundary[0]),
                                                  folded(y, box.min[1], box.max[1], box.boundary[1]),
                                                  start.z() + path * way.z());
    const double up = 2.0 * unit_double(u.words[1][row]) - 1.0, out = std::sqrt((1.0 - up) * (1.0 + up));
    const double azimuth = 2.0 * std::numbers::pi * unit_double(u.words[2][row]);
    r.set(kept, place, {out * std::cos(azimuth), out * std::sin(azimuth), up});
    r.from[kept] = surface::kNoTriangle;
    r.ray[kept] = r.ray[row];
    u.home[kept] = u.home[row];
}

// Copies particles that hit or left back to their rows in the block; those that collided stay in flight.
void settle(const Geometry& geometry, UnderWay& u, Rays& block) {
    const Rays& r = u.rays;
    std::size_t kept = 0;
    for (std::size_t row = 0; row < r.count; ++row) {
        if (r.triangle[row] == kCollided) {
            collide(geometry, row, kept++, u);
            continue;
        }
        const std::size_t home = u.home[row];
        block.copy(home, r, row);
        block.triangle[home] = r.triangle[row];
        block.u[home] = r.u[row], block.v[home] = r.v[row];
        block.nx[home] = r.nx[row], block.ny[home] = r.ny[row], block.nz[home] = r.nz[row];
        block.distance[home] = r.distance[row];
    }
    u.rays.count = kept;
}

}  // namespace

bool fly_through_gas(const Trace& trace, Rays& rays, const Event& event, FlightCounts& flights) {
    static thread_local UnderWay under_way;  // too large for a stack frame
    const RandomKey key = gas_key(trace.key);
    begin(rays, under_way);
    for (std::uint32_t collision = 0; under_way.rays.count > 0; ++collision) {
        if (collision % 256 == 255 && trace.stop()) return false;
        if (collision == trace.max_bounces) {
            for (std::size_t row = 0; row < under_way.rays.count; ++row)
                rays.triangle[under_way.home[row]] = kLeaked;
            break;
        }
        draw_paths(key, trace.species.mean_free_path, event, collision, under_way);
        fly_block_within(trace.geometry, under_way.rays, under_way.free_path, flights);
        settle(trace.geometry, under_way, rays);
    }
    return true;
}

}  // namespace sidewall::flux
