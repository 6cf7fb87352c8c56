#pragma once
#include <functional>

#include "surface/triangle_mesh.hpp"

// A surface mirrored, turned or shifted.
namespace sidewall::flux {

/// A transformed surface; `back` maps a point on it to the point of the original.
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

/// A periodic surface with its sides moved to x = \p plane_x and y = \p plane_y. `back` is exact within half
/// a period of \p centre, a point of the original.
Placed placed_shifted(const TriangleMesh& mesh, double plane_x, double plane_y, const Vec3& centre);

}  // namespace sidewall::flux
