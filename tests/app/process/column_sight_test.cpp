#include "app/process/arriving/line_of_sight.hpp"

#include <catch2/catch.hpp>
#include <random>

#include "surface/ray_scene.hpp"
#include "tests/surface/surface_meshes.hpp"

using namespace sidewall;
using namespace sidewall::app;
using namespace sidewall::surface;

TEST_CASE("what lies straight above a point outside a closed surface is what a ray meets") {
    // A torus on edge, so that points lie above, below, in its hole and beside it.
    TriangleMesh mesh = test::torus_mesh(48, 2.0, 0.7);
    const double tilt = 1.1;
    for (Vec3& p : mesh.vertices)
        p = Vec3(p.x(), std::cos(tilt) * p.y() - std::sin(tilt) * p.z(),
                 std::sin(tilt) * p.y() + std::cos(tilt) * p.z());
    const RayScene scene(mesh);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> place(-3.0, 3.0);
    for (const double width : {0.02, 0.3, 10.0}) {
        const ColumnSight columns(mesh, width);
        int open = 0, hidden = 0;
        for (int n = 0; n < 4000; ++n) {
            const Vec3 point(place(random), place(random), place(random));
            // A point inside has an odd number of faces above it.
            int above = 0;
            SurfaceHit hit = scene.closest_hit(point, Vec3::UnitZ(), 0.0, 100.0);
            for (; hit; ++above) hit = scene.closest_hit(point, Vec3::UnitZ(), hit.distance + 1e-6, 100.0);
            if (above % 2 != 0) continue;
            ++(above == 0 ? open : hidden);
            CAPTURE(width, point.transpose());
            REQUIRE(columns.open_above(point) == (above == 0));
        }
        CHECK(open > 500);
        CHECK(hidden > 100);
    }
}
