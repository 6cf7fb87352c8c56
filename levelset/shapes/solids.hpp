#pragma once
#include <optional>

#include "levelset/domain.hpp"
#include "levelset/shapes/body.hpp"
#include "levelset/shapes/shapes.hpp"

namespace sidewall::levelset {

/// The bodies that are no wafer with something in or on it: spheres, cylinders, gaps, profiles, boxes with rounded edges,
/// and all that is to be subtracted but planes and meshes. Nothing for others; see make_body, which calls this.
/// \throws GeometryError for lengths that make no body.
std::optional<Body> make_solid(const Shape& shape, const Domain& domain);

}  // namespace sidewall::levelset
