#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "surface/vec3.hpp"

namespace sidewall::flux {

/// Particles that are traced together, at most. Enough to fill packets to the end of long histories, few
/// enough for the second-level cache.
constexpr std::size_t kBlock = 1024;
constexpr std::size_t kLanes = 8;  ///< of a packet

template <class T>
using Column = std::array<T, kBlock + kLanes>;  // a packet may run over the end

/// Particles at the start of a flight, one a row; and, after fly_block, what they hit. World units,
/// single precision throughout: what the tracer sees is what is computed with.
struct alignas(64) Rays {
    std::size_t count = 0;
    Column<float> x, y, z;         ///< start of the flight; after it, of its last segment
    Column<float> dx, dy, dz;      ///< unit direction
    Column<std::uint32_t> from;    ///< triangle it leaves, or kNoTriangle
    Column<std::uint32_t> ray;     ///< number within the batch
    Column<std::uint64_t> weight;  ///< 2^-28 particles
    Column<float> energy;          ///< eV
    // Set by fly_block:
    Column<std::uint32_t> triangle;  ///< it hit, kNoTriangle if it escaped, kLeaked if it leaked
    Column<float> u, v;              ///< barycentric weights of its second and third vertex
    Column<float> nx, ny, nz;        ///< its outward normal, any length; zero if it has no area
    Column<float> distance;          ///< along the last segment
};

/// Where a row's flight starts and which way it goes.
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

}  // namespace sidewall::flux
