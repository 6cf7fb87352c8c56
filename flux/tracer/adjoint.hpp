#pragma once
#include <cstdint>
#include <span>
#include <utility>

#include "flux/tracer/particle_history.hpp"

// Adjoint (backward) sampling of first arrivals. The point of a first arrival is drawn on the surface,
// equally often on every triangle, and its direction from the source; a ray back along it tests whether the
// source is visible. From its first hit on, the particle is traced forwards like any other. A steep wall,
// which few particles of a narrow source reach, gets as many paths as a floor. On unshadowed flat ground of
// equal triangles all paths weigh the same.
namespace sidewall::flux {

/// Whether first arrivals of \p species can be sampled backwards: its source is cos^n about the vertical with
/// n at least 50, so that the weight of a path is bounded, no gas collisions deflect it, and nothing desorbs.
bool allows_adjoint(const Species& species);

/// The fewest adjoint paths of a round: four batches with three paths on every triangle.
std::uint64_t fewest_adjoint_paths(const TriangleMesh& mesh);

/// The number of batches for about \p rays adjoint paths, at most \p most unless bins would overflow, and the
/// paths of each: a multiple of three on every triangle. Three start at one point whose barycentric weights
/// are rotated through the corners, so that a uniform flux is tallied evenly.
/// \pre rays >= fewest_adjoint_paths
std::pair<std::uint64_t, std::uint32_t> adjoint_batches(std::uint64_t rays, std::uint64_t most,
                                                        const TriangleMesh& mesh);

/// Whether a pass uses adjoint sampling: it is asked for, allowed for the only species, and rays are enough.
bool uses_adjoint(std::span<const Species> pass, const TriangleMesh& mesh, const TraceOptions& options);

/// Fills worker.rays with particles at their first hits, as found by adjoint paths [first, first + count) of
/// the batch. Paths shadowed from the source count as escaped. A particle weighs (-d . n) / (-d . z), for the
/// source's direction d and the normal n, times its triangle's area and the number of triangles over the
/// source's area: on average a batch brings as much as an equal number of particles from the source.
/// \pre batch is one of adjoint_batches, count <= kBlock.
void emit_adjoint(const Trace& trace, const Batch& batch, std::uint32_t first, std::uint32_t count,
                  Worker& worker);

}  // namespace sidewall::flux
