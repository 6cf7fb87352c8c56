#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "flux/radiosity/profile_unknowns.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::flux {

/// A point or a direction in the plane of x and z.
struct Vec2 {
    double x, z;
};
inline Vec2 operator-(Vec2 a, Vec2 b) {
    return {a.x - b.x, a.z - b.z};
}
inline double cross(Vec2 a, Vec2 b) {
    return a.x * b.z - a.z * b.x;
}

/// A facet as a segment in the plane; its normal is to the left of the direction from first to second end.
struct Segment {
    std::array<std::uint32_t, 2> end;      ///< the ends, as indices of points
    std::array<std::uint32_t, 2> unknown;  ///< unknowns of the exchange at the ends
    Vec2 normal;
    double area;
    std::uint32_t triangle;  ///< first triangle of the facet
};

/// A profile as points and segments, ordered so that each begins where the one before it ends.
struct Outline {
    std::vector<Vec2> points;
    std::vector<Segment> segments;
    Vec2 at(const Segment& one, double along) const {
        const Vec2 begin = points[one.end[0]], way = points[one.end[1]] - begin;
        return {begin.x + along * way.x, begin.z + along * way.z};
    }
};

/// The outline of a mesh that is a profile. Facets without area are left out.
/// \note O(n log n).
Outline outline_of(const TriangleMesh& mesh, const ProfileUnknowns& profile);

}  // namespace sidewall::flux
