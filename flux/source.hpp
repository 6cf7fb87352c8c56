#pragma once
#include <array>
#include <cstdint>

#include "flux/flight.hpp"
#include "flux/random.hpp"
#include "flux/rays.hpp"
#include "flux/species.hpp"

namespace sidewall::flux {

/// Particles of a batch: `count` of them, numbered along a Hilbert curve over the source plane. Particle i
/// starts in the i-th of `count` equal pieces of the curve, and leaves in the i-th direction of a scrambled
/// Sobol sequence, so that any aligned run of 4^k neighbours has stratified directions too: a scrambled net
/// in curve x direction.
struct Batch {
    std::uint32_t number = 0;
    std::uint32_t count = 0;
    std::uint64_t stride = 0;               ///< 2^64 / count: the curve's length of a particle
    std::array<std::uint32_t, 4> scramble;  ///< of the directions
};

/// \pre count >= 1.
Batch make_batch(RandomKey key, std::uint32_t number, std::uint32_t count);

/// Fills \p rays with particles [first, first + count) of the batch.
/// \pre count <= kBlock.
void emit(const Geometry& geometry, const Species& species, RandomKey key, const Batch& batch,
          std::uint32_t first, std::uint32_t count, Rays& rays);

}  // namespace sidewall::flux
