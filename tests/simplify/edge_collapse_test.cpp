#include "simplify/edge_collapse.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

using namespace sidewall;
using namespace sidewall::simplify;

namespace {

// A roof with four ridge points and eaves at y = +-1. Its sides slope by \p degrees.
TriangleMesh roof(double degrees) {
    const double height = std::tan(degrees * std::numbers::pi / 180.0);
    TriangleMesh mesh;
    for (int i = 0; i < 4; ++i)
        for (int side = -1; side <= 1; ++side)
            mesh.vertices.emplace_back(2.0 * i, side, side == 0 ? height : 0.0);
    for (std::uint32_t i = 0; i < 3; ++i)
        for (std::uint32_t k = 0; k < 2; ++k) {
            const std::uint32_t a = 3 * i + k, b = a + 3;
            mesh.triangles.push_back({a, b, b + 1});
            mesh.triangles.push_back({a, b + 1, a + 1});
        }
    return mesh;
}

// Whether the middle ridge edge may collapse so that the slope there goes from \p from to \p to degrees.
bool rises(double from, double to) {
    const CollapseMesh mesh(roof(from));
    for (std::uint32_t h = 0; h < mesh.corner.size(); ++h) {
        if (mesh.start(h) != 4 || mesh.end(h) != 7) continue;
        Vec3 place = 0.5 * (mesh.position(4) + mesh.position(7));
        place.z() += mesh.scale *
                     (std::tan(to * std::numbers::pi / 180.0) - std::tan(from * std::numbers::pi / 180.0));
        Surroundings around;
        return can_collapse(mesh, h, place, around);
    }
    FAIL("the ridge has no such edge");
    return false;
}

// Whether the only inner vertex may collapse onto \p vertex of the side plane y = 0. Vertex 2, in the middle
// of the five there, is a bump.
bool goes_to_side(std::uint32_t vertex) {
    TriangleMesh mesh;
    mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0.3}, {3, 0, 0}, {4, 0, 0},
                     {2, 1, 0}, {0, 2, 0}, {2, 2, 0},   {4, 2, 0}};
    mesh.triangles = {{1, 2, 5}, {2, 3, 5}, {3, 8, 5}, {8, 7, 5}, {7, 6, 5}, {6, 1, 5}, {0, 1, 6}, {3, 4, 8}};
    const CollapseMesh collapse(mesh);
    for (std::uint32_t h = 0; h < collapse.corner.size(); ++h) {
        if (collapse.start(h) != 5 || collapse.end(h) != vertex) continue;
        Surroundings around;
        return can_collapse(collapse, h, collapse.position(vertex), around);
    }
    FAIL("no such edge");
    return false;
}

}  // namespace

TEST_CASE("a collapse leaves no triangle in a side plane") {
    CHECK(goes_to_side(2));
    CHECK_FALSE(goes_to_side(1));  // the triangle 1, 2, 3 would lie in the side plane
    CHECK_FALSE(goes_to_side(3));
}

TEST_CASE("a collapse may not fold neighbours onto each other, unless they are folded already") {
    CHECK(rises(60.0, 60.0));
    CHECK(rises(60.0, 65.0));
    CHECK_FALSE(rises(60.0, 87.0));  // folds them, though each side turns by less than 30 degrees
    CHECK(rises(80.0, 82.0));        // the sides were folded before
}
