#pragma once
#include "levelset/domain.hpp"
#include "levelset/shapes/body.hpp"
#include "levelset/shapes/shapes.hpp"

namespace sidewall::levelset {

/// Whether make_solid() makes the shape: spheres, cylinders, gaps, profiles, boxes with rounded edges, and all that is
/// to be subtracted but meshes.
bool is_solid(const Shape& shape);

/// The bodies that are no wafer with something in or on it; see make_body, which calls this.
/// \throws GeometryError for lengths that make no body.
Body make_solid(const Shape& shape, const Domain& domain);

}  // namespace sidewall::levelset
