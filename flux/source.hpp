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

/// A batch of `count` particles, numbered along a Hilbert curve over the source plane. Particle i starts in
/// the i-th of `count` equal pieces of the curve and leaves in the i-th direction of a scrambled Sobol
/// sequence: a scrambled net in curve x direction, in which any aligned run of 4^k neighbours is stratified.
struct Batch {
    std::uint32_t number = 0;
    std::uint32_t count = 0;
    std::uint64_t stride = 0;               ///< length of a particle's piece; the whole curve has 2^64
    std::array<std::uint32_t, 4> scramble;  ///< Owen scrambling of the directions
};

/// Most particles of a batch, so that bins hold 4096 hits of each (kMostHits). More rays make more batches.
constexpr std::uint64_t kMostBatchRays = std::uint64_t{1} << 24;

/// Draws the batch's scrambling words. \pre count >= 1.
Batch make_batch(RandomKey key, std::uint32_t number, std::uint32_t count);

/// Emission from the surface in addition to the source plane. All particles carry the same amount, so that
/// surface and plane get particles in proportion to what they send.
struct SurfaceSource {
    double share = 0.0;                      ///< share of all particles that start on the surface
    std::vector<double> until = {};          ///< by triangle: cumulative share of what the surface sends
    std::vector<double> emission = {};       ///< flux sent, by wedge
    std::vector<std::uint32_t> corner = {};  ///< Wedges::corner
};

/// \param emission  by wedge, at least 0; empty if nothing starts on the surface.
/// \param plane     amount that the source plane sends: its area at flux 1.
SurfaceSource make_surface_source(const TriangleMesh& mesh, const Wedges& wedges,
                                  std::span<const double> emission, double plane);

/// Fills \p rays with particles [first, first + count) of the batch: those before batch.count * (1 -
/// surface.share) from the source plane, the others from the surface. Each weighs kOne; on the plane of an
/// axial box that is the mean, and the weight grows with r.
/// \pre count <= kBlock.
void emit(const Geometry& geometry, const Species& species, const SurfaceSource& surface, RandomKey key,
          const Batch& batch, std::uint32_t first, std::uint32_t count, Rays& rays);

}  // namespace sidewall::flux
