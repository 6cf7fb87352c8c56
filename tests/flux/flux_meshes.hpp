#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numbers>
#include <utility>
#include <vector>

#include "flux/lateral.hpp"
#include "surface/triangle_mesh.hpp"

// Surfaces the flux tests build, each ending exactly on its rectangle.
namespace sidewall::flux {

inline constexpr double kPi = std::numbers::pi, kDegree = kPi / 180.0;
inline constexpr std::array kReflective{Boundary::reflective, Boundary::reflective};
inline constexpr std::array kPeriodic{Boundary::periodic, Boundary::periodic};

using Profile = std::vector<std::pair<double, double>>;  // (x, z) from left to right, the material below

/// Two triangles a cell over [0, x] x [0, y] at z = height(x, y).
TriangleMesh height_field(std::size_t nx, std::size_t ny, double x, double y,
                          const std::function<double(std::size_t, std::size_t)>& height);

/// A profile extruded along y from 0 to \p length in \p rows. Segment s of the profile becomes the 2 \p rows
/// triangles from number 2 \p rows s on.
TriangleMesh extrude(const Profile& profile, double length, std::size_t rows = 1);

/// The mesh turned by 90 degrees about z, so that a trench along y lies along x.
TriangleMesh turned(TriangleMesh mesh);

/// The trench of width 1 and the given depth between flat ledges, its walls and floor cut at the given
/// fractions (of depth, of width), ascending and without 0 and 1. Segment 0 is the left ledge, then left
/// wall, floor, right wall.
Profile trench_profile(double depth, double ledge, const std::vector<double>& wall_cuts,
                       const std::vector<double>& floor_cuts);

/// A round hole of \p facets sides (a multiple of 8) whose polygon has the area of a circle of the given
/// radius, in a square plate. Materials: 0 plate, 1 wall, 2 floor within \p core, 3 the rest of the floor.
struct Hole {
    TriangleMesh mesh;
    std::vector<std::int32_t> materials;
};

Hole round_hole(double radius, double depth, double half_side, std::size_t facets, double core);

}  // namespace sidewall::flux
