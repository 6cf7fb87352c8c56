#include <catch2/catch.hpp>
#include <cmath>
#include <functional>

#include "levelset/openvdb_grid.hpp"
#include "tests/levelset/grids.hpp"

// Fronts on, near and between nodes of the grid.

using namespace sidewall;
using namespace sidewall::levelset;

namespace {

using Distance = std::function<double(const Vec3&)>;

// A box with half sizes of 9, 8 and 7 cells, plus \p offset.
Distance block(double offset) {
    return [=](const Vec3& p) {
        const Vec3 q = p.cwiseAbs() - Vec3(9.0, 8.0, 7.0) - Vec3::Constant(offset);
        return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
    };
}

// Gas in an endless channel of half width 8 and depth 9 cells, plus \p offset, in a solid up to z = 0.
Distance channel(double offset) {
    return [=](const Vec3& p) {
        const double half = 8.0 + offset, depth = 9.0 + offset, x = std::abs(p.x()), z = p.z();
        const auto beside = [&](double u, double v) {
            return std::hypot(std::max(u, 0.0), std::max(v, 0.0));
        };
        if (z > 0.0 || (x < half && z > -depth)) {  // in the gas
            const double shoulder = beside(half - x, z);
            return std::min(shoulder, z + depth);
        }
        const double wall = beside(x - half, -depth - z);
        return -std::min(-z, std::max(wall, 0.0)) * (x > half || z < -depth ? 1.0 : 0.0);
    };
}

// Largest error, in cells, of a grid's distances that are less than \p within.
double error(const Grid& grid, const Domain& domain, const Distance& exact, double within) {
    double most = 0.0;
    for (auto it = grid.cbeginValueOn(); it; ++it) {
        const auto c = it.getCoord();
        const double d =
            exact({domain.coordinate(0, c.x()), domain.coordinate(1, c.y()), c.z() * domain.spacing});
        if (std::abs(d) < within) most = std::max(most, std::abs(double(*it) - d));
    }
    return most;
}

constexpr double kOffsets[] = {0.0, 1e-6, -1e-6, 0.13, 0.4, 0.5, 0.8};

}  // namespace

TEST_CASE("re-distancing keeps distances around edges and corners, wherever faces lie between nodes") {
    const Domain domain = test::unit_domain(40);
    // Around an edge normals come from central differences, which are off by a sixth of phi's third
    // derivative: by at most 0.14 / r^2 at r cells from the edge, and r is at least one cell.
    constexpr double kFan = 0.14;
    for (const bool is_block : {true, false})
        for (const double offset : kOffsets) {
            const Distance exact = is_block ? block(offset) : channel(offset);
            CAPTURE(is_block, offset);
            const GridPtr grid = sample_grid(domain, exact, -15.0, 15.0), anew = grid->deepCopy();
            redistance(*anew, domain, kSweepsAnew);
            CHECK(error(*anew, domain, exact, 2.9) < kFan);
            for (int n = 0; n < 100; ++n) {
                redistance(*grid, domain);
                if (n == 0 || n == 9) CHECK(error(*grid, domain, exact, 2.9) < kFan);
            }
            CHECK(error(*grid, domain, exact, 2.9) < kFan);
            // Beside edges that lie on nodes nothing is interpolated.
            if (std::abs(offset) < 1e-5) CHECK(error(*grid, domain, exact, 1.6) < 0.01);
        }
}

TEST_CASE("the node above a rim on nodes is a cell away from it") {
    const Domain domain = test::unit_domain(40);
    const GridPtr grid = sample_grid(domain, channel(0.0), -15.0, 15.0);
    for (int n = 0; n < 10; ++n) redistance(*grid, domain);
    for (const int x : {12, 28})
        CHECK(static_cast<double>(grid->tree().getValue(openvdb::Coord(x, 20, 1))) ==
              Approx(1.0).margin(1e-3));
}

TEST_CASE("walls that have grown together on a plane of nodes, or between two, leave no gap") {
    for (const double middle : {0.0, 0.3, 0.5}) {
        const Domain domain = make_domain({40.0, 2.0}, 1.0, {Side::reflective, Side::periodic});
        Shape trench{.kind = ShapeKind::trench, .width = 10.0, .depth = 20.0};
        trench.position = {middle, 0.0};
        MaterialStack stack = make_stack(domain, {{0, trench}});
        test::move(stack, 5.0, {}, [](std::size_t, const Vec3&) { return 1.0; });
        CAPTURE(middle);
        // Beyond the rims the front may sink, but by no more than the band's half width.
        for (const Vec3& p : extract_surface(stack.top(), domain).vertices) CHECK(p.z() > -kHalfWidth);
    }
}

TEST_CASE("a wall without width, where two trenches meet on a plane of nodes, is none") {
    const Domain domain = make_domain({40.0, 2.0}, 1.0, {Side::reflective, Side::periodic});
    Shape trench{.kind = ShapeKind::trench, .width = 16.0, .depth = 10.0};
    trench.position = {-12.0, 0.0};  // its mirror image begins where it ends
    Shape cut = trench;
    cut.subtract = true;
    const Shape plane{.kind = ShapeKind::plane};
    for (const bool subtract : {false, true}) {
        MaterialStack stack =
            subtract ? make_stack(domain, {{0, plane}, {0, cut}}) : make_stack(domain, {{0, trench}});
        for (int n = 0; n < 3; ++n, redistance(stack.top(), domain))
            for (auto it = stack.top().cbeginValueOn(); it; ++it)
                if (const auto c = it.getCoord(); domain.coordinate(0, c.x()) < -10.0) {
                    CAPTURE(subtract, n, c.x(), c.z());
                    // Shapes that are cut out are larger by 1e-4 cells.
                    CHECK(double(*it) == Approx(c.z() + 10.0).margin(3e-3));
                }
    }
}
