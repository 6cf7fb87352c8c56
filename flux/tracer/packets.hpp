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

/// A row of three columns, in double precision.
inline Vec3 vector_at(const Column<float>& x, const Column<float>& y, const Column<float>& z,
                      std::size_t row) {
    return {static_cast<double>(x[row]), static_cast<double>(y[row]), static_cast<double>(z[row])};
}
inline void set_vector(const Vec3& v, Column<float>& x, Column<float>& y, Column<float>& z, std::size_t row) {
    x[row] = static_cast<float>(v.x());
    y[row] = static_cast<float>(v.y());
    z[row] = static_cast<float>(v.z());
}

/// The weight of one whole particle in the fixed point of weights and tallies.
constexpr std::uint64_t kOne = std::uint64_t{1} << 28;

/// Starts of flights, one a row: points and unit directions. World units, single precision throughout: what the tracer
/// sees is what is computed with.
struct FlightStarts {
    Column<float> x, y, z, dx, dy, dz;

    Vec3 point(std::size_t row) const { return vector_at(x, y, z, row); }
    Vec3 direction(std::size_t row) const { return vector_at(dx, dy, dz, row); }
    void set(std::size_t row, const Vec3& point, const Vec3& direction) {
        set_vector(point, x, y, z, row);
        set_vector(direction, dx, dy, dz, row);
    }
    /// Takes row \p of of others.
    void copy(std::size_t row, const FlightStarts& others, std::size_t of) {
        x[row] = others.x[of], y[row] = others.y[of], z[row] = others.z[of];
        dx[row] = others.dx[of], dy[row] = others.dy[of], dz[row] = others.dz[of];
    }
};

/// Particles at the start of a flight; after fly_block, of its last segment, and what they hit.
struct alignas(64) Rays : FlightStarts {
    std::size_t count = 0;
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
/// Those that get that far have the triangle kCollided, and positions that mean nothing but in an axial box, where they
/// are the places of the collisions.
void fly_block_within(const Geometry& geometry, Rays& rays, const Column<float>& free_path,
                      FlightCounts& counts);

}  // namespace sidewall::flux
