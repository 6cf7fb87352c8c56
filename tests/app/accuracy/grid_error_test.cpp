#include "app/accuracy/accuracy_bars.hpp"

#include <catch2/catch.hpp>
#include <cmath>

using namespace sidewall::app;

namespace {

// A figure of limit + c h^p at grid spacings h of 0.4, 0.2 and 0.1.
std::vector<GridValue> figures(double limit, double c, double p) {
    std::vector<GridValue> grids;
    for (const double h : {0.4, 0.2, 0.1}) grids.push_back({h, limit + c * std::pow(h, p), 0.0});
    return grids;
}

}  // namespace

TEST_CASE("the bar of the finest of three grids holds the limit of a figure of order 0.5 to 3") {
    for (const double p : {0.5, 0.7, 1.0, 1.5, 2.0, 3.0})
        for (const double c : {-1.0, 1.0}) {
            const auto grids = figures(2.0, c, p);
            const GridError error = grid_error(grids, 0.0);
            INFO("order " << p << ", bar " << error.bar);
            CHECK(error.falling());
            CHECK(std::abs(grids.back().value - 2.0) <= error.bar);
        }
    // At order 1 the bar is the error, 0.1, times the safety factor.
    CHECK(grid_error(figures(2.0, 1.0, 1.0), 0.0).bar == Approx(1.25 * 0.1));
}

TEST_CASE("values that agree by chance, go up and down or come closer by less and less keep an honest bar") {
    // The last two values agree by chance. At order 2 a quarter of the first difference, 0.1, would be left.
    CHECK(grid_error({{0.4, 1.4, 0.0}, {0.2, 1.0, 0.0}, {0.1, 1.0, 0.0}}, 0.0).bar == Approx(1.25 * 0.1));
    CHECK(grid_error({{0.4, 1.0, 0.0}, {0.2, 1.2, 0.0}, {0.1, 1.1, 0.0}}, 0.0).bar == Approx(1.25 * 0.1));
    const GridError growing = grid_error({{0.4, 1.0, 0.0}, {0.2, 1.1, 0.0}, {0.1, 1.3, 0.0}}, 0.0);
    CHECK_FALSE(growing.falling());
    CHECK(growing.bar == Approx(3.0 * 0.2));
    // Differences within the noise do not count as divergence.
    CHECK(grid_error({{0.4, 1.0, 0.2}, {0.2, 1.1, 0.2}, {0.1, 1.3, 0.2}}, 0.0).falling());
    CHECK(grid_error({{0.4, 1.0, 0.0}, {0.2, 1.0, 0.0}, {0.1, 1.0, 0.0}}, 0.005).bar == 0.005);
}

TEST_CASE("two grids tell a bar three times their difference, and one tells none") {
    const GridError two = grid_error({{0.4, NAN, 0.0}, {0.2, 1.1, 0.0}, {0.1, 1.0, 0.0}}, 0.0);
    CHECK(two.bar == Approx(3.0 * 0.1));
    CHECK_THAT(two.reason, Catch::Contains("only two grids"));
    CHECK(std::isinf(grid_error({{0.2, NAN, 0.0}, {0.1, 1.0, 0.0}}, 0.0).bar));
    CHECK(std::isinf(grid_error({{0.2, 1.0, 0.0}, {0.1, NAN, 0.0}}, 0.0).bar));
}
