#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "flux/tracer/flight.hpp"
#include "surface/vec3.hpp"

namespace sidewall::flux {

/// Most particles that are traced together, as a block: enough to fill packets to the end of long histories,
/// few enough for the second-level cache.
constexpr std::size_t kBlock = 1024;
constexpr std::size_t kLanes = 8;  ///< rays of a packet

template <class T>
using Column = std::array<T, kBlock + kLanes>;  // the last packet may run over the end of the block

/// One row of three columns as a vector, in double precision.
inline Vec3 vector_at(const Column<float>& x, const Column<float>& y, const Column<float>& z,
                      std::size_t row) {
    return {static_cast<double>(x[row]), static_cast<double>(y[row]), static_cast<double>(z[row])};
}
inline void set_vector(const Vec3& v, Column<float>& x, Column<float>& y, Column<float>& z, std::size_t row) {
    x[row] = static_cast<float>(v.x());
    y[row] = static_cast<float>(v.y());
    z[row] = static_cast<float>(v.z());
}

/// The weight of one whole particle in the fixed-point numbers of weights and tallies.
constexpr std::uint64_t kOne = std::uint64_t{1} << 28;

/// Starts of flights, one a row: points and unit directions, in world units. Single precision throughout, so
/// that Embree gets exactly the values that are computed with.
struct FlightStarts {
    Column<float> x, y, z, dx, dy, dz;

    Vec3 point(std::size_t row) const { return vector_at(x, y, z, row); }
    Vec3 direction(std::size_t row) const { return vector_at(dx, dy, dz, row); }
    void set(std::size_t row, const Vec3& point, const Vec3& direction) {
        set_vector(point, x, y, z, row);
        set_vector(direction, dx, dy, dz, row);
    }
    /// Copies row \p of of \p others to \p row.
    void copy(std::size_t row, const FlightStarts& others, std::size_t of) {
        x[row] = others.x[of], y[row] = others.y[of], z[row] = others.z[of];
        dx[row] = others.dx[of], dy[row] = others.dy[of], dz[row] = others.dz[of];
    }
};

/// Particles at the start of a flight; after fly_block, at the start of its last segment, with what they hit.
struct alignas(64) Rays : FlightStarts {
    std::size_t count = 0;
    Column<std::uint32_t> from;    ///< triangle that it leaves, or kNoTriangle
    Column<std::uint32_t> ray;     ///< number within the batch
    Column<std::uint64_t> weight;  ///< in units of 1 / kOne
    Column<float> energy;          ///< eV
    // Set by fly_block:
    Column<std::uint32_t> triangle;  ///< triangle hit, kNoTriangle if escaped, kLeaked, or kCollided
    Column<float> u, v;              ///< barycentric weights of that triangle's second and third vertex
    Column<float> nx, ny, nz;        ///< outward normal of the triangle, any length; zero if it has no area
    Column<float> distance;          ///< of the hit along the last segment
};

constexpr std::uint32_t kLeaked = 0xfffffffeu;
constexpr std::uint32_t kCollided = 0xfffffffdu;  ///< the free path ended first, see fly_block_within

/// Counts of the flights of fly_block.
struct FlightCounts {
    std::uint64_t segments = 0;  ///< ray-scene intersections
    std::uint64_t rescued = 0;   ///< see fly
};

/// fly() for all \p rays, in packets of eight: sets what they hit, and the start and direction of their last
/// segment. The few that neither hit the front of another triangle nor clearly leave are flown again one by
/// one by fly(). The order of the rays changes the result by rounding only, and threads do not change it.
void fly_block(const Geometry& geometry, Rays& rays, FlightCounts& counts);

/// fly_block() for particles that collide in a gas: row i flies at most \p free_path[i] (world units),
/// through sides. Those that get that far have the triangle kCollided. Their positions are those of the
/// collisions in an axial box and meaningless in others.
void fly_block_within(const Geometry& geometry, Rays& rays, const Column<float>& free_path,
                      FlightCounts& counts);

}  // namespace sidewall::flux
