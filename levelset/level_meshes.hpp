#pragma once
#include <cstddef>

#include "levelset/stack.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::levelset {

/// extract_surface of a stack with several levels.
TriangleMesh mesh_of_levels(const MaterialStack& stack, std::size_t layer);

}  // namespace sidewall::levelset
