#pragma once
#include <functional>

#include "surface/triangle_mesh.hpp"

// The same surface placed otherwise.
namespace sidewall::flux {

/// A surface placed otherwise, and the way back: from a point on it to the point of the original.
struct Placed {
    const char* how;
    TriangleMesh mesh;
    std::function<Vec3(const Vec3&)> back;
};

Placed placed_mirrored(TriangleMesh mesh);

Placed placed_turned(const TriangleMesh& mesh);

/// Cuts a periodic surface at \p axis = \p plane and moves the lower part up by a period. Triangles are
/// split; attributes are lost.
TriangleMesh wrapped(const TriangleMesh& mesh, int axis, double plane);

/// The periodic domain shifted along both axes, its sides anywhere on the surface. \p back is exact within
/// half a period of \p centre, a point of the original.
Placed placed_shifted(const TriangleMesh& mesh, double plane_x, double plane_y, const Vec3& centre);

}  // namespace sidewall::flux
