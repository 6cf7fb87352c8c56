#include "levelset/redistance.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "levelset/openvdb_grid.hpp"
#include "surface/error.hpp"
#include "tests/levelset/grids.hpp"

using namespace sidewall;
using namespace sidewall::levelset;

TEST_CASE("a hundred re-distances keep a sphere's volume to 1e-4 and its front to 1e-3 dx") {
    const Domain domain = test::unit_domain(70);
    const GridPtr grid = test::sphere_grid(domain, 30);
    const TriangleMesh before = extract_surface(*grid, domain);
    for (int n = 0; n < 100; ++n) redistance(*grid, domain);
    const TriangleMesh after = extract_surface(*grid, domain);
    CHECK(std::abs(enclosed_volume(after) / enclosed_volume(before) - 1.0) < 1e-4);
    REQUIRE(after.vertices.size() == before.vertices.size());
    double moved = 0.0;
    for (std::size_t v = 0; v < after.vertices.size(); ++v)
        moved = std::max(moved, (after.vertices[v] - before.vertices[v]).norm());
    CHECK(moved < 1e-3);
}

TEST_CASE("a function with the right front becomes a signed distance, second order in dx / r") {
    double error[2];
    for (int level = 0; level < 2; ++level) {
        const double radius = 20.0 * (1 + level);
        const Domain domain = test::unit_domain(static_cast<int>(2 * radius + 12));
        // Up to 20 % too flat on one side of the sphere and too steep on the other; the front is exact.
        const GridPtr grid = sample_grid(
            domain,
            [=](const Vec3& p) {
                const double d = p.norm() - radius;
                return d * (1.0 + 0.25 * std::tanh(p.x() / radius));
            },
            -radius - 5, radius + 5);
        for (int n = 0; n < 10; ++n) redistance(*grid, domain, 4);
        error[level] = 0.0;
        for (auto it = grid->cbeginValueOn(); it; ++it) {
            const auto c = it.getCoord();
            const Vec3 p(domain.coordinate(0, c.x()), domain.coordinate(1, c.y()), c.z());
            // Within a cell of the front the slope is restored to 2 % only; farther distances add that up.
            error[level] = std::max(error[level], std::abs(double(*it) - (p.norm() - radius)));
        }
    }
    // The re-scaling's tolerance of 2 % over the cell next to the front, and curvature errors that fall with
    // dx / r.
    CHECK(error[1] < 0.05);
    CHECK(error[0] < 0.08);
}

TEST_CASE("re-distancing leaves the flats and the edge of a mirrored trench where they are") {
    const Domain domain = test::unit_domain(40);
    Shape trench;
    trench.kind = ShapeKind::trench;
    trench.width = 15.3;
    trench.depth = 20.4;
    MaterialStack stack = make_stack(domain, {{0, trench}});
    const TriangleMesh before = extract_surface(stack.top(), domain);
    for (int n = 0; n < 50; ++n) redistance(stack.top(), domain);
    const TriangleMesh after = extract_surface(stack.top(), domain);
    REQUIRE(after.vertices.size() == before.vertices.size());
    double moved = 0.0;
    for (std::size_t v = 0; v < after.vertices.size(); ++v)
        moved = std::max(moved, (after.vertices[v] - before.vertices[v]).norm());
    CHECK(moved < 1e-3);
}

TEST_CASE("a surface that has vanished or is not finite is reported") {
    const Domain domain = test::unit_domain(20);
    const GridPtr empty = make_grid(domain);
    CHECK_THROWS_AS(redistance(*empty, domain), NumericsError);
    const GridPtr broken = test::sphere_grid(domain, 6);
    broken->tree().beginValueOn().setValue(std::nanf(""));
    CHECK_THROWS_AS(redistance(*broken, domain), NumericsError);
}

TEST_CASE("re-distancing gives the same bits whether or not it remembers which leaves are at rest") {
    const Domain domain = make_domain({64.0, 2.0}, 1.0, {Side::reflective, Side::periodic});
    Shape silicon, mask;
    mask.kind = ShapeKind::trench;
    mask.top = 20.3;
    mask.width = 14.6;
    mask.depth = std::numeric_limits<double>::infinity();
    MaterialStack remembers = make_stack(domain, {{0, silicon}, {1, mask}});
    MaterialStack forgets = copy(remembers);
    const auto etch = [](std::size_t layer, const Vec3&) { return layer == 0 ? -1.0 : 0.0; };
    std::size_t at_rest = 0;
    for (int n = 0; n < 24; ++n) {
        at_rest = 0;
        for (auto leaf = remembers.top().tree().cbeginLeaf(); leaf; ++leaf)
            at_rest += leaf->transientData() != 0;
        for (auto leaf = forgets.top().tree().beginLeaf(); leaf; ++leaf) leaf->setTransientData(0);
        test::move(remembers, 0.4, {}, etch);
        test::move(forgets, 0.4, {}, etch);
    }
    CHECK(at_rest > remembers.top().tree().leafCount() / 4);
    REQUIRE(forgets.top().activeVoxelCount() == remembers.top().activeVoxelCount());
    for (auto it = remembers.top().cbeginValueOn(); it; ++it)
        REQUIRE(forgets.top().tree().getValue(it.getCoord()) == *it);
}
