#pragma once
#include <string>

#include "levelset/domain.hpp"
#include "levelset/shapes/body.hpp"
#include "levelset/shapes/shapes.hpp"
#include "surface/repair.hpp"

namespace sidewall::levelset {

/// A surface from a mesh file that tells gas from material within the domain.
struct ImportedMesh {
    TriangleMesh mesh;  ///< with copies of closed bodies over and near periodic sides, a period away
    surface::Repairs repairs = {};  ///< what was mended, openings that lie off the domain's sides among it
    Box3 bounds;                    ///< of the file's own triangles
    std::size_t over = 0;           ///< closed parts that reach over a periodic side
};

/// Reads a mesh file and mends it (surface/repair.hpp).
/// \throws FileError if it cannot be read, GeometryError with the place of what cannot be mended.
ImportedMesh import_mesh(const std::string& file, const Domain& domain);

/// The body of a mesh layer: the union of the file's closed bodies, less the cavities in them, and of what lies below its open
/// surfaces.
/// \throws as import_mesh().
Body mesh_body(const Shape& shape, const Domain& domain);

}  // namespace sidewall::levelset
