#pragma once
#include <string>

#include "levelset/domain.hpp"
#include "levelset/shapes/body.hpp"
#include "levelset/shapes/shapes.hpp"
#include "surface/repair.hpp"

namespace sidewall::levelset {

/// A mesh file's surface, repaired so that it separates gas from material within the domain.
struct ImportedMesh {
    TriangleMesh mesh;  ///< with copies, a period away, of closed bodies over or near periodic sides
    surface::Repairs repairs = {};  ///< those made, the closing of openings off the domain's sides included
    Box3 bounds;                    ///< of the file's triangles, without copies
    std::size_t over = 0;           ///< closed parts that reach over a periodic side
};

/// Reads a mesh file and repairs it (surface/repair.hpp).
/// \throws FileError if it cannot be read, GeometryError with the place of what cannot be repaired.
ImportedMesh import_mesh(const std::string& file, const Domain& domain);

/// The body of a mesh layer: the union of the file's closed bodies, less their cavities, and of all that lies
/// below its open surfaces.
/// \throws as import_mesh().
Body mesh_body(const Shape& shape, const Domain& domain);

}  // namespace sidewall::levelset
