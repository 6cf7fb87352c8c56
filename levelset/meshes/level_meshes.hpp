#pragma once
#include <cstddef>

#include "levelset/layers/stack.hpp"
#include "surface/cut.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::levelset {

/// The front of layer \p layer of a stack of several levels as one mesh; only its part near \p around, if that is given.
/// \param around  may be null.
TriangleMesh mesh_of_levels(const MaterialStack& stack, std::size_t layer, const surface::Plane* around);

}  // namespace sidewall::levelset
