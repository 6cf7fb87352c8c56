#pragma once
#include <cstdint>
#include <vector>

#include "app/process/arriving/traced_surface.hpp"
#include "levelset/layers/stack.hpp"
#include "levelset/motion/speed_extension.hpp"

namespace sidewall::app {

/// Finds which nodes at the edge of a body (levelset::find_bodies) lie in the shadow of what covers it, and what etches those.
///
/// The surface point nearest to such a node lies on or near the edge, where faces meet whose fluxes differ: a floor and the
/// mask's wall that stands on it. A node that sees all beams moves like any other (Extension::kNoBody). The front gets to one in
/// the shadow through the body's own face if it lies straight behind that, else at the speed that what arrives on the face that
/// sees least would give its body; it gets a sample there.
/// \returns by edge node, direct part and beam, in this order: whether the beam is hidden from the node.
/// \pre the surface has a scene and fluxes, and beams that are seen along a line (SurfaceFlux::direct).
std::vector<std::uint8_t> choose_faces(const TracedSurface& surface, const levelset::MaterialStack& stack,
                                       levelset::Extension& extension);

}  // namespace sidewall::app
