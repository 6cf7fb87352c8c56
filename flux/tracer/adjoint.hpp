#pragma once
#include <cstdint>
#include <span>
#include <utility>

#include "flux/tracer/particle_history.hpp"

// Bottom-up starts of paths. Where particles of a narrow source first arrive is chosen on the surface, as
// often on every triangle, and looks back along the source's directions; from there on they live as others
// do. A steep wall, which few particles of the source come to, is looked from as often as a floor, and where
// nothing hides the source from flat ground all looks tell the same.
namespace sidewall::flux {

/// Whether first arrivals of \p species can be looked for: its source is cos^n about the vertical, n at least 50, so that
/// directions bound the weight of a look, and nothing happens on the way.
bool can_look(const Species& species);

/// The fewest looks of a round: four batches of three on every triangle.
std::uint64_t fewest_looks(const TriangleMesh& mesh);

/// Batches of a round of about \p rays looks, at most \p most of them but where their bins hold no more, and the looks of
/// each: a multiple of three on every triangle. Places of the three are one with its corners in turn, so that they share a flux
/// that is the same all over out evenly.
/// \pre rays >= fewest_looks
std::pair<std::uint64_t, std::uint32_t> batches_of_looks(std::uint64_t rays, std::uint64_t most,
                                                         const TriangleMesh& mesh);

/// Whether the only species of a pass can look and options.rays are enough for the fewest looks.
bool starts_bottom_up(std::span<const Species> pass, const TriangleMesh& mesh, const TraceOptions& options);

/// Fills worker.rays with the particles that looks [first, first + count) of the batch see arrive, as if they had flown. Looks
/// that the surface hides from the source end as escaped. Every one weighs (-d . n) / (-d . z) for the source's direction d and
/// the normal n, times its triangle's area and the number of triangles over the source's area: so that the looks of a batch bring on average
/// what as many particles do.
/// \pre batch is one of batches_of_looks, count <= kBlock.
void look(const Trace& trace, const Batch& batch, std::uint32_t first, std::uint32_t count, Worker& worker);

}  // namespace sidewall::flux
