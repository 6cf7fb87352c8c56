#pragma once
#include <cstdint>
#include <span>
#include <utility>

#include "flux/tracer/particle_history.hpp"

// Adjoint (backward) sampling of first arrivals. The place of a first arrival is drawn on the surface,
// equally often on every triangle, and its direction from the source; a ray back along it shows whether the
// source sees the place. From there on the particle lives as others do. A steep wall, which few particles of
// a narrow source come to, gets as many paths as a floor, and where nothing hides the source from flat ground
// all paths weigh the same.
namespace sidewall::flux {

/// Whether first arrivals of \p species can be sampled so: its source is cos^n about the vertical, n at least 50, so that
/// directions bound the weight of a path, and nothing happens on the way.
bool allows_adjoint(const Species& species);

/// The fewest adjoint paths of a round: four batches of three on every triangle.
std::uint64_t fewest_adjoint_paths(const TriangleMesh& mesh);

/// Batches of a round of about \p rays adjoint paths, at most \p most of them unless their bins would overflow, and the paths
/// of each: a multiple of three on every triangle. The three start at one place rotated through the corners, so that a
/// uniform flux is shared out evenly.
/// \pre rays >= fewest_adjoint_paths
std::pair<std::uint64_t, std::uint32_t> adjoint_batches(std::uint64_t rays, std::uint64_t most,
                                                        const TriangleMesh& mesh);

/// Whether a pass is traced so: by its options and only species, with rays enough for the fewest paths.
bool uses_adjoint(std::span<const Species> pass, const TriangleMesh& mesh, const TraceOptions& options);

/// Fills worker.rays with the particles that adjoint paths [first, first + count) of the batch find to arrive, as if they
/// had flown. Paths that the surface hides from the source end as escaped. A particle weighs (-d . n) / (-d . z), for the
/// source's direction d and the normal n, times its triangle's area and the number of triangles over the source's area: a
/// batch brings on average what as many particles from the source do.
/// \pre batch is one of adjoint_batches, count <= kBlock.
void emit_adjoint(const Trace& trace, const Batch& batch, std::uint32_t first, std::uint32_t count,
                  Worker& worker);

}  // namespace sidewall::flux
