#pragma once
#include "flux/tracer/flight.hpp"

namespace sidewall::flux {

/// How a ray that hits nothing leaves the domain.
struct WayOut {
    bool to_source = false;  ///< through the source plane, not past an open side
    double length = 0.0;     ///< to the plane
    Vec3 end;                ///< there, straightened
};

/// \param start, direction  where it began, before any side it crossed.
inline WayOut way_out(const Geometry& geometry, const Vec3& start, const Vec3& direction) {
    const double length = direction.z() > 0.0 ? (geometry.top - start.z()) / direction.z() : -1.0;
    WayOut way{length >= 0.0, length, start + length * direction};
    const LateralBox& box = geometry.box;
    for (int axis = 0; axis < 2; ++axis)
        if (box.boundary[axis] == Boundary::open)
            way.to_source = way.to_source && way.end[axis] >= box.min[axis] && way.end[axis] <= box.max[axis];
    return way;
}

}  // namespace sidewall::flux
