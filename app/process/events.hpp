#pragma once
#include <string>
#include <vector>

#include "app/process/state.hpp"
#include "app/recipe/recipe.hpp"
#include "levelset/meshes/pieces.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// Records what is detached, shut in or absent at the start, so that it is not reported later.
void begin_events(const Recipe& recipe, RunState& state);

/// Adds to the state's history what has happened since the last call:
/// - a material has vanished: less than 1 % is left of its largest volume at the start or after a step;
/// - a piece of material has lost its support, e.g. a mask undercut from both sides. It stays in place.
///   Pieces and voids of less than a cell's volume do not count;
/// - a void has closed;
/// - the surface has reached the bottom of the substrate: its underside if read from a mesh, else 20,000
///   grid spacings below z = 0, the depth to which recipes can describe a wafer; or has come as far up.
///
/// \param surface  extracted from the state's stack.
/// \param pieces   of \p surface.
/// \param step     index of the recipe's step that made this surface.
/// \returns how many events were added.
/// \note O(n).
std::size_t note_events(const Recipe& recipe, const TriangleMesh& surface,
                        const std::vector<levelset::SurfacePiece>& pieces, std::size_t step, RunState& state);

/// An event in one line: when, in which step, what and where.
std::string event_line(const Recipe& recipe, const std::vector<Step>& steps, const Event& event);

}  // namespace sidewall::app
