#include "levelset/shapes/polygon.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>

#include "levelset/layers/make_stack.hpp"

using namespace sidewall;
using namespace sidewall::levelset;

TEST_CASE("the distance to a polygon is exact, whichever way round it runs") {
    const Polygon there{{0, 0}, {2, 0}, {2, 1}, {0, 1}}, back{{0, 1}, {2, 1}, {2, 0}, {0, 0}};
    for (const Polygon& box : {there, back}) {
        const std::vector<Polygon> one{box};
        CHECK(signed_distance(one, 1.0, 0.25) == -0.25);
        CHECK(signed_distance(one, 5.0, 5.0) == Approx(5.0));
        CHECK(signed_distance(one, 1.0, 1.5) == 0.5);
        CHECK(signed_distance(one, 2.0, 0.5) == 0.0);
    }
    const Polygon other{{4, 0}, {5, 0}, {5, 1}};
    CHECK(signed_distance(std::vector<Polygon>{there, other}, 3.5, 0.0) == 0.5);
    CHECK(signed_distance({}, 0.0, 0.0) == std::numeric_limits<double>::infinity());
}

TEST_CASE("a polygon across a periodic side opens the mask on both") {
    const Domain domain = make_domain({4.0, 2.0}, 0.1, {Side::periodic, Side::reflective});
    Shape mask{.kind = ShapeKind::mask, .top = 0.5};
    mask.polygons = {{{1.5, -0.5}, {2.5, -0.5}, {2.5, 0.5}, {1.5, 0.5}}};
    for (const bool openings : {true, false}) {
        mask.openings = openings;
        const MaterialStack stack = make_stack(domain, {{0, Shape{}}, {1, mask}});
        const double open = openings ? 0.0 : 0.5;
        for (const Vec3& p : {Vec3(1.8, 0.2, open), Vec3(-1.8, -0.2, open), Vec3(0.0, 0.0, 0.5 - open)})
            CHECK(std::abs(distance_at(stack.top(), domain, p)) < 1e-3);
    }
}

TEST_CASE("the index of polygons gives the distance to the last bit") {
    std::mt19937 random(1);
    const auto number = [&](double size) {
        return size * (static_cast<double>(random()) / 4294967296.0 - 0.5);
    };
    std::vector<Polygon> polygons;
    for (int k = 0; k < 60; ++k) {  // small and large ones, which overlap and cross themselves
        Polygon& polygon = polygons.emplace_back();
        const double x = number(10.0), y = number(10.0), size = k % 7 == 0 ? 6.0 : 0.5;
        for (int corners = k % 10 == 0 ? 500 : 3 + k % 5; corners > 0; --corners)
            polygon.push_back({x + number(size), y + number(size)});
    }
    const PolygonIndex index(polygons);
    for (int k = 0; k < 4000; ++k) {
        const auto& corner = polygons[static_cast<std::size_t>(k) % polygons.size()][0];
        const double x = k % 5 == 0 ? corner[0] : number(14.0), y = k % 10 == 0 ? corner[1] : number(14.0);
        REQUIRE(index.signed_distance(x, y) == signed_distance(polygons, x, y));
    }
    CHECK(PolygonIndex({}).signed_distance(0.0, 0.0) == std::numeric_limits<double>::infinity());
}
