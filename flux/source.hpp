#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "flux/random.hpp"
#include "flux/species.hpp"
#include "flux/tracer/packets.hpp"
#include "flux/wedges.hpp"

namespace sidewall::flux {

/// Particles of a batch: `count` of them, numbered along a Hilbert curve over the source plane. Particle i
/// starts in the i-th of `count` equal pieces of the curve, and leaves in the i-th direction of a scrambled
/// Sobol sequence, so that any aligned run of 4^k neighbours has stratified directions too: a scrambled net
/// in curve x direction.
struct Batch {
    std::uint32_t number = 0;
    std::uint32_t count = 0;
    std::uint64_t stride = 0;               ///< 2^64 / count: the curve's length of a particle
    std::array<std::uint32_t, 4> scramble;  ///< Owen scrambling of the directions
};

/// A batch's bins and counters hold this many particles whatever they do; more rays make more batches.
constexpr std::uint64_t kMostBatchRays = std::uint64_t{1} << 24;

/// \pre count >= 1.
Batch make_batch(RandomKey key, std::uint32_t number, std::uint32_t count);

/// Emission from the surface beside that from the source plane. All particles stand for the same amount, so that both get
/// particles in proportion to what they send.
struct SurfaceSource {
    double share = 0.0;                      ///< of all particles; 0: none starts on the surface
    std::vector<double> until = {};          ///< by triangle: cumulative share of what the surface sends
    std::vector<double> emission = {};       ///< by wedge
    std::vector<std::uint32_t> corner = {};  ///< Wedges::corner
};

/// \param emission  by wedge, at least 0; empty if nothing starts on the surface.
/// \param plane  what the source plane sends: its area.
SurfaceSource make_surface_source(const TriangleMesh& mesh, const Wedges& wedges,
                                  std::span<const double> emission, double plane);

/// Fills \p rays with particles [first, first + count) of the batch: those before batch.count * (1 - surface.share) from the
/// source plane, the others from the surface. All weigh kOne, but from the plane of an axial box on average only.
/// \pre count <= kBlock.
void emit(const Geometry& geometry, const Species& species, const SurfaceSource& surface, RandomKey key,
          const Batch& batch, std::uint32_t first, std::uint32_t count, Rays& rays);

}  // namespace sidewall::flux
