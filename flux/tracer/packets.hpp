#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "flux/tracer/flight.hpp"
#include "surface/vec3.hpp"

namespace sidewall::flux {

/// Particles that are traced together, at most. Enough to fill packets to the end of long histories, few
/// enough for the second-level cache.
constexpr std::size_t kBlock = 1024;
constexpr std::size_t kLanes = 8;  ///< of a packet

template <class T>
using Column = std::array<T, kBlock + kLanes>;  // a packet may run over the end

/// The weight of one whole particle in the fixed point of weights and tallies.
constexpr std::uint64_t kOne = std::uint64_t{1} << 28;

/// Particles at the start of a flight, one a row; and, after fly_block, what they hit. World units,
/// single precision throughout: what the tracer sees is what is computed with.
struct alignas(64) Rays {
    std::size_t count = 0;
    Column<float> x, y, z;         ///< start of the flight; after it, of its last segment
    Column<float> dx, dy, dz;      ///< unit direction
    Column<std::uint32_t> from;    ///< triangle it leaves, or kNoTriangle
    Column<std::uint32_t> ray;     ///< number within the batch
    Column<std::uint64_t> weight;  ///< in units of 1 / kOne
    Column<float> energy;          ///< eV
    // Set by fly_block:
    Column<std::uint32_t> triangle;  ///< it hit, kNoTriangle if it escaped, kLeaked if it leaked
    Column<float> u, v;              ///< barycentric weights of its second and third vertex
    Column<float> nx, ny, nz;        ///< its outward normal, any length; zero if it has no area
    Column<float> distance;          ///< along the last segment
};

/// Sets the start and the direction of a row's flight.
inline void set_flight(Rays& rays, std::size_t row, const Vec3& point, const Vec3& direction) {
    rays.x[row] = static_cast<float>(point.x());
    rays.y[row] = static_cast<float>(point.y());
    rays.z[row] = static_cast<float>(point.z());
    rays.dx[row] = static_cast<float>(direction.x());
    rays.dy[row] = static_cast<float>(direction.y());
    rays.dz[row] = static_cast<float>(direction.z());
}

/// A row of three columns, in double precision.
inline Vec3 vector_at(const Column<float>& x, const Column<float>& y, const Column<float>& z,
                      std::size_t row) {
    return {static_cast<double>(x[row]), static_cast<double>(y[row]), static_cast<double>(z[row])};
}

constexpr std::uint32_t kLeaked = 0xfffffffeu;
constexpr std::uint32_t kCollided = 0xfffffffdu;  ///< its free path ended first: fly_block_within

/// Counts of the flights of fly_block.
struct FlightCounts {
    std::uint64_t segments = 0;  ///< ray-scene intersections
    std::uint64_t rescued = 0;   ///< see fly
};

/// fly() for all \p rays, in packets of eight: sets what they hit, and the start and direction of their
/// last segment. The few that hit anything but the front of another triangle, and do not clearly leave,
/// fly again one by one, with fly()'s care. The result depends on the order of the rays by rounding only, and not on
/// the thread.
void fly_block(const Geometry& geometry, Rays& rays, FlightCounts& counts);

/// fly_block() for particles that collide in a gas: row i flies at most \p free_path[i], through sides, in world units.
/// Those that get that far have the triangle kCollided, and positions that mean nothing.
void fly_block_within(const Geometry& geometry, Rays& rays, const Column<float>& free_path,
                      FlightCounts& counts);

}  // namespace sidewall::flux
