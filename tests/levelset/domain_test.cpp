#include "levelset/domain.hpp"

#include <catch2/catch.hpp>
#include <limits>

#include "surface/error.hpp"

using namespace sidewall;
using namespace sidewall::levelset;

TEST_CASE("a ghost beyond a reflective side mirrors about the side's node, however far it lies") {
    const Domain d = make_domain({4, 4}, 1.0, {Side::reflective, Side::reflective});
    for (int i = -20; i <= 20; ++i) {
        const int source = d.source_node(0, i);
        CHECK(source >= 0);
        CHECK(source <= 4);
        CHECK(d.source_node(0, -i) == source);     // mirror at node 0
        CHECK(d.source_node(0, 8 - i) == source);  // mirror at node 4
    }
    for (int i = 0; i <= 4; ++i) CHECK(d.source_node(0, i) == i);
}

TEST_CASE("a ghost beyond a periodic side repeats the node one period away") {
    const Domain d = make_domain({4, 6}, 1.0, {Side::reflective, Side::periodic});
    CHECK(d.last_node(1) == 5);
    for (int j = -20; j <= 20; ++j) CHECK(d.source_node(1, j) == ((j % 6) + 6) % 6);
}

TEST_CASE("the spacing is rounded to the nearest one that divides both extents") {
    const Domain d = make_domain({10, 10}, 0.24, {Side::reflective, Side::reflective});
    CHECK(d.cells == std::array<int, 2>{42, 42});
    CHECK(d.spacing == Approx(10.0 / 42.0).epsilon(1e-15));
    const Domain e = make_domain({10, 0.5}, 0.24, {Side::reflective, Side::periodic});
    CHECK(e.cells == std::array<int, 2>{40, 2});
    CHECK(d.coordinate(0, 42) == 5.0);  // the side itself, to the last bit
    CHECK(d.coordinate(0, 0) == -5.0);
}

TEST_CASE("extents and spacings that make no grid are refused") {
    const std::array<Side, 2> sides{Side::reflective, Side::reflective};
    const double nan = std::numeric_limits<double>::quiet_NaN();
    CHECK_THROWS_AS(make_domain({0, 1}, 0.1, sides), RecipeError);
    CHECK_THROWS_AS(make_domain({1, nan}, 0.1, sides), RecipeError);
    CHECK_THROWS_AS(make_domain({1, 1}, 0.0, sides), RecipeError);
    CHECK_THROWS_AS(make_domain({1, 1}, nan, sides), RecipeError);
    CHECK_THROWS_AS(make_domain({1, 1}, 1e-9, sides), RecipeError);
    CHECK_THROWS_AS(make_domain({1, 3.14159}, 0.3, sides), RecipeError);
    // 12 and 46 times 0.1 are no short decimals in floating point; the advice is rounded.
    CHECK_THROWS_WITH(make_domain({1.23, 4.57}, 0.1, sides), Catch::EndsWith("e.g. [1.2, 4.6]"));
}
