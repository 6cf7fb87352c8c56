#include "levelset/meshes/divide.hpp"

#include <catch2/catch.hpp>

using namespace sidewall;
using namespace sidewall::levelset;

namespace {

// Two triangles whose shared edge is divided at a point \p height above its middle; the number of parts.
std::size_t parts_with_point(double height) {
    TriangleMesh mesh;
    mesh.vertices = {Vec3(0, -0.1, 0), Vec3(0, 0.1, 0), Vec3(1, 0, 0), Vec3(-1, 0, 0), Vec3(0, 0, height)};
    mesh.triangles = {{0, 2, 1}, {0, 1, 3}};
    EdgePoints points{{divided_edge(0, 1), 4}};
    drop_folds(mesh, -0.8, points);
    return divided(mesh, points).triangles.size();
}

}  // namespace

TEST_CASE("a point that would lay two parts of triangles on each other is left out") {
    CHECK(parts_with_point(0.05) == 4);
    // The parts at the point stand 2 atan(0.1 / 2), 6 degrees, apart.
    CHECK(parts_with_point(2.0) == 2);
}

TEST_CASE("a triangle whose three edges are divided at one point has no parts") {
    TriangleMesh mesh;
    mesh.vertices = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0.3, 0.3, 0)};
    mesh.triangles = {{0, 1, 2}};
    EdgePoints points{{divided_edge(0, 1), 3}, {divided_edge(1, 2), 3}, {divided_edge(2, 0), 3}};
    drop_folds(mesh, -0.8, points);
    CHECK(divided(mesh, points).triangles.empty());
}
