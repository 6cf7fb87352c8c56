#pragma once
#include <algorithm>
#include <array>
#include <limits>

#include "surface/triangle_mesh.hpp"

namespace sidewall::flux {

/// Lateral boundary condition: a particle leaves, is mirrored, or re-enters on the opposite side.
enum class Boundary { open, reflective, periodic };

/// The lateral extent of the domain, world units; z is open. The boundary is per axis (x, y).
struct LateralBox {
    std::array<double, 2> min{}, max{};
    std::array<Boundary, 2> boundary{};
    bool rim_inside = false;  ///< the surface ends inside the box: a particle that passes its rim and hits
                              ///< its back has escaped
    /// The surface is a sector of a surface of revolution (flux/revolution.hpp), with its axis at x = min[0]
    /// = 0 and as wide as the box at x = max[0], where a cylinder mirrors particles. They fly in three
    /// dimensions.
    bool axial = false;
    /// Length after which the surface repeats along x and y; 0 where it does not, or is the same all along.
    std::array<double, 2> period{};
    double area() const { return (max[0] - min[0]) * (max[1] - min[1]) * (axial ? 0.5 : 1.0); }
};

/// Checks what every function of this folder relies on: triangles that name existing vertices, finite
/// coordinates, and a size and position that single precision resolves. O(n).
/// \throws GeometryError naming the first offender.
void require_traceable(const TriangleMesh& mesh);

/// The lateral box of \p mesh, which is its bounding rectangle in x and y.
///
/// A reflective or periodic box needs a surface that ends on its sides: every boundary edge in one of the
/// four side planes, and the whole rectangle covered once, facing up. If both axes are open, any mesh that
/// faces up (or is closed with normals pointing outwards) will do. A single connected boundary off the sides
/// is then the surface's rim (rim_inside); with several, some are holes and none counts as the rim.
/// \throws GeometryError saying where the surface does not end on the rectangle, or that it is inside out.
/// \note O(n log n).
LateralBox lateral_box(const TriangleMesh& mesh, std::array<Boundary, 2> boundary);

/// The next side plane that a straight path meets; distance in units of the direction's length.
struct SideMeeting {
    double distance = std::numeric_limits<double>::infinity();
    int axis = 0;
};

/// The side plane ahead of \p position, which lies in the box or on its sides. The distance is never
/// negative: a particle that sits on a side and moves outwards meets it at once.
inline SideMeeting next_side(const LateralBox& box, const Vec3& position, const Vec3& direction) {
    SideMeeting meeting;
    for (int axis = 0; axis < 2; ++axis) {
        const double speed = direction[axis];
        if (speed == 0.0) continue;
        const double plane = speed > 0.0 ? box.max[axis] : box.min[axis];
        const double distance = std::max(0.0, (plane - position[axis]) / speed);
        if (distance < meeting.distance) meeting = {distance, axis};
    }
    return meeting;
}

/// Moves a particle to the side it meets, then mirrors its direction or wraps its position, which ends
/// exactly on a side plane.
/// \returns false if that side is open: the particle is gone.
inline bool cross_side(const LateralBox& box, const SideMeeting& meeting, Vec3& position, Vec3& direction) {
    const int axis = meeting.axis, other = 1 - axis;
    if (box.boundary[axis] == Boundary::open) return false;
    position += meeting.distance * direction;
    position[other] = std::clamp(position[other], box.min[other], box.max[other]);
    const bool reflect = box.boundary[axis] == Boundary::reflective;
    position[axis] = (direction[axis] > 0.0) == reflect ? box.max[axis] : box.min[axis];
    if (reflect) direction[axis] = -direction[axis];
    return true;
}

}  // namespace sidewall::flux
