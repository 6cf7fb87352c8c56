#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "app/process/arriving/traced_surface.hpp"
#include "levelset/layers/stack.hpp"
#include "levelset/motion/speed_extension.hpp"

namespace sidewall::app {

/// Finds which nodes at the edge of a body (levelset::find_bodies) lie in the shadow of its cover, and with
/// which face's speed the front reaches those.
///
/// The surface point nearest to such a node lies on or near the edge, where faces of different fluxes meet,
/// e.g. a floor and the wall of a mask on it. A node that sees all beams moves like any other
/// (Extension::kNoBody). To a node in the shadow the front comes through the body's own face if the node lies
/// straight behind it, else at the speed that the fluxes of the darkest face would give the body; the node's
/// sample is moved to that face.
/// \returns by edge node, direct part and beam, in this order: whether the beam is hidden from the node.
/// \pre the surface has a scene, fluxes and direct parts (SurfaceFlux::direct).
std::vector<std::uint8_t> choose_faces(const TracedSurface& surface, const levelset::MaterialStack& stack,
                                       levelset::Extension& extension);

/// Finds how much of what arrives beside an edge arrives at the nodes behind it, where an inert cover hides
/// a part of the source: the front reaches a node at the speed that the fluxes at the node give its body.
///
/// Unless nothing is hidden, the sample of a node is moved to the face of its body beside the edge that looks
/// away from the node most, whose fluxes are known. Of these the share that comes straight from the source is
/// taken in the vertical plane of the node and the edge, from the face and from the node. Sets
/// Extension::shaded.
/// \param inert  the materials of covers; a film that is etched slowly opens soon, and does not count.
/// \returns by edge node and species: the node's fluxes over those of its sample; 1 for tilted sources and
///     those of tables.
/// \pre the surface has a scene and fluxes.
std::vector<double> shade_nodes(const TracedSurface& surface, const levelset::MaterialStack& stack,
                                std::span<const flux::Species> species, std::span<const std::int32_t> inert,
                                levelset::Extension& extension);

}  // namespace sidewall::app
