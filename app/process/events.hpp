#pragma once
#include <string>
#include <vector>

#include "app/process/state.hpp"
#include "app/recipe/recipe.hpp"
#include "levelset/meshes/pieces.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// Notes what hangs, is shut in or missing from the start, which is no event.
void begin_events(const Recipe& recipe, RunState& state);

/// Notes in the state's history what has happened since the last call:
///
/// - a material of which no more than a hundredth is left of the most that a step began with or made;
/// - a piece of material that nothing below holds any more, as a mask undercut from both sides. It stays where it
///   is. Pieces of less than a cell's volume do not count, here and among voids;
/// - a void that has closed;
/// - a surface that has come to the bottom of the substrate: the underside of one read from a mesh, else
///   20,000 grid spacings below z = 0, beyond which a recipe cannot describe a wafer; or as far up.
///
/// \param surface  as extracted from the state's stack.
/// \param pieces   its own.
/// \param step     of the recipe, that made it what it is.
/// \returns how many events were added.
/// \note O(n).
std::size_t note_events(const Recipe& recipe, const TriangleMesh& surface,
                        const std::vector<levelset::SurfacePiece>& pieces, std::size_t step, RunState& state);

/// An event in one line: when, in which step, what and where.
std::string event_line(const Recipe& recipe, const std::vector<Step>& steps, const Event& event);

}  // namespace sidewall::app
