#pragma once
#include "levelset/domain.hpp"
#include "levelset/shapes/body.hpp"
#include "levelset/shapes/shapes.hpp"

namespace sidewall::levelset {

/// The body of \p shape in \p domain; all but a mesh repeat on a periodic axis. If the shape is subtracted,
/// the body is what is removed: the opening of a trench, hole or mask from its bottom up, the space above an
/// open profile, else the shape without a wafer below. A mesh may be closed or open (then the side its
/// normals point to is outside); its sign comes from angle-weighted normals (Baerentzen and Aanaes, IEEE
/// Trans. Vis. Comput. Graph. 11 (2005) 243).
/// \throws GeometryError for lengths that make no body, FileError for a mesh file that cannot be read.
Body make_body(const Shape& shape, const Domain& domain);

}  // namespace sidewall::levelset
