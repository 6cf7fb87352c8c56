#pragma once
#include <cstddef>

#include "levelset/layers/stack.hpp"
#include "surface/cut.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::levelset {

/// extract_surface of a stack with several levels, or extract_around.
/// \param around  may be null.
TriangleMesh mesh_of_levels(const MaterialStack& stack, std::size_t layer, const surface::Plane* around);

}  // namespace sidewall::levelset
