#include "levelset/shapes/polygon_clipping.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>

#include "levelset/shapes/outline.hpp"
#include "surface/error.hpp"

using namespace sidewall;
using namespace sidewall::levelset;

namespace {

constexpr double kHalfTurn = std::numbers::pi;

Polygon block(double x0, double y0, double x1, double y1) {
    return {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
}

double path_area(const Polygon& points, const PathStyle& style) {
    return area_of(united(path_polygons(points, style)));
}

// The centre line of a ring from 0 to \p end degrees, with a point every \p step degrees.
Polygon arc(double radius, int end, int step) {
    Polygon points;
    for (int a = 0; a <= end; a += step)
        points.push_back(
            {radius * std::cos(a * kHalfTurn / 180.0), radius * std::sin(a * kHalfTurn / 180.0)});
    return points;
}

}  // namespace

TEST_CASE("a path with mitred bends and flush ends is as large as its length times its width") {
    // A mitred bend loses as much area inside as it gains outside.
    CHECK(path_area({{-4, 0}, {0, 0}, {3, 3}}, {.half_width = 1.0}) ==
          Approx(2.0 * (4.0 + 3.0 * std::sqrt(2.0))));
    CHECK(path_area({{0, 0}, {4, 0}, {6, 2 * std::sqrt(3.0)}}, {.half_width = 0.5}) == Approx(8.0));
    // In a bend of over 90 degrees the mitre is cut off half a width beyond the bend.
    const double turn = std::atan2(4.5, -2.2), cut = 0.25 * (std::tan(0.5 * turn) - 1.0);
    CHECK(path_area({{0, 0}, {5, 0}, {2.8, 4.5}}, {.half_width = 0.25}) ==
          Approx(0.5 * (5.0 + std::hypot(2.2, 4.5)) - 0.5 * cut * cut * std::sin(turn)));
    // A half ring of 5-degree pieces, which are shorter than half the path's width.
    const double length = 36 * 2.0 * 3.0 * std::sin(2.5 * kHalfTurn / 180.0);
    CHECK(path_area(arc(3.0, 180, 5), {.half_width = 1.0}) == Approx(2.0 * length));
    CHECK(2.0 * length == Approx(kHalfTurn / 2.0 * (16.0 - 4.0)).epsilon(1e-3));
    // A path of more points than are outlined together, in 1-degree pieces.
    CHECK(path_area(arc(5.0, 300, 1), {.half_width = 2.0}) ==
          Approx(4.0 * 300 * 10.0 * std::sin(0.5 * kHalfTurn / 180.0)));
}

TEST_CASE(
    "a path whose first or last pieces are shorter than half its width is as large as its length times its width") {
    const auto both_ways = [](Polygon points, double half_width, double length) {
        for (int way = 0; way < 2; ++way) {
            CHECK(path_area(points, {.half_width = half_width}) == Approx(2.0 * half_width * length));
            CHECK(united(path_polygons(points, {.half_width = half_width})).size() == 1);
            std::reverse(points.begin(), points.end());
        }
    };
    both_ways({{-3, 0}, {2, 0}, {2, 0.2}}, 0.5, 5.2);
    both_ways({{-3, 0}, {2, 0}, {2, -0.1}, {2, -0.2}}, 0.5, 5.2);
    both_ways({{-3, 0}, {1.9, 0}, {2, 0}, {2, 0.2}}, 0.5, 5.2);
    both_ways({{-3, 0.3}, {-3, 0}, {2, 0}, {2, 0.2}}, 0.5, 5.5);
    both_ways({{0, 0.2}, {0, 0}, {1.2, 0}, {1.2, 0.2}}, 0.5, 1.6);                    // outlined as a whole
    both_ways({{0, 0}, {2, 0}, {2.1, 0.1}, {2.1, 0.2}}, 0.5, 2.1 + std::sqrt(0.02));  // 90 degrees in two
    both_ways({{-5, 0}, {0, 0}, {0.3, 0.3 * std::sqrt(3.0)}, {0.4, 0.3 * std::sqrt(3.0)}}, 0.5, 5.7);
    // Inside the bend the outline crosses itself; the triangle that it goes around twice counts once.
    const double twice = 0.25 - (std::sqrt(0.5) - 0.5);
    CHECK(path_area({{0, 0}, {2, 0}, {2.1, 0.1}, {2.1, 0.35}}, {.half_width = 0.5}) ==
          Approx(2.25 + std::sqrt(0.02) - 0.5 * twice * twice));
    // An extended end makes the last piece, 0.2, long enough; a negative extension shortens the path.
    CHECK(path_area({{-3, 0}, {2, 0}, {2, 0.2}}, {.half_width = 0.5, .end = 0.5}) == Approx(5.7));
    CHECK(path_area({{-3, 0}, {2, 0}, {2, 1.2}}, {.half_width = 0.5, .end = -1.0}) == Approx(5.2));
}

TEST_CASE("a path of sharp bends and short pieces covers what KLayout draws") {
    // Areas of RBA::Path's polygon, merged, of KLayout 0.28.5.
    const auto check = [](Polygon points, double half_width, double extension, double area) {
        for (int way = 0; way < 2; ++way) {
            CHECK(path_area(points, {.half_width = half_width, .begin = extension, .end = extension}) ==
                  Approx(area).epsilon(1e-4));
            std::reverse(points.begin(), points.end());
        }
    };
    check({{0, 0}, {5, 0}, {2.8, 4.5}}, 0.25, 0.0, 4.99433);
    check({{-5, 0}, {0, 0}, {-0.15, 0.2598}}, 0.5, 0.0, 5.49901);
    check({{-3, 0}, {0.5, 0}, {0.2, 0.3}}, 0.5, 0.0, 4.05399);
    check({{-3, 0}, {0.5, 0}, {0.3268, 0.1}}, 0.5, 0.0, 4.03185);
    check({{-3, 0}, {0.5, 0}, {0.1, 0}}, 0.5, 0.0, 4.0);  // turns back on itself
    check({{-3, 0}, {2, 0}, {-0.5981, 1.5}}, 0.5, 0.5, 8.53342);
    check({{0, 0}, {0.35, 0}, {0.067, 0.198}, {1.502, 0.564}, {1.294, 0.661}, {1.46, 0.726}, {1.355, 0.454}},
          0.5, 0.3, 3.1633);
    check({{0, 0}, {0.186, 0}, {0.285, 0.212}, {0.497, 0.247}}, 0.5, 0.0, 0.63483);
}

TEST_CASE("a long path covers as much as one that is outlined as one piece") {
    // A comb of 300 teeth: pieces end within its long segments, and none is drawn twice or missing.
    Polygon comb;
    for (int k = 0; k < 300; ++k)
        for (const double y : k % 2 == 0 ? std::array{0.0, 20.0} : std::array{20.0, 0.0})
            comb.push_back({static_cast<double>(k), y});
    CHECK(path_area(comb, {.half_width = 0.2}) == Approx(0.4 * (300 * 20.0 + 299.0)));
    CHECK(united(path_polygons(comb, {.half_width = 0.2, .round = true})).size() == 1);
    CHECK(path_area(comb, {.half_width = 0.2, .begin = 1.0, .end = 2.0}) ==
          Approx(0.4 * (300 * 20.0 + 302.0)));
}

TEST_CASE("points on a straight path, near its ends or twice, change nothing") {
    const Polygon straight{{-3, 0}, {2, 0}};
    for (const Polygon& points :
         {Polygon{{-3, 0}, {1.9, 0}, {2, 0}}, Polygon{{-3, 0}, {-2.95, 0}, {-2.9, 0}, {2, 0}},
          Polygon{{-3, 0}, {-3, 0}, {0, 0}, {0, 0}, {2, 0}}}) {
        CHECK(path_area(points, {.half_width = 0.5}) == Approx(5.0));
        const auto outlines = united(path_polygons(points, {.half_width = 0.5}));
        REQUIRE(outlines.size() == 1);
        for (const auto& p : outlines[0]) CHECK(std::abs(p[0] + 0.5) <= 2.5 + 1e-9);
    }
    CHECK(path_area(straight, {.half_width = 0.5}) == Approx(5.0));
}

TEST_CASE("a path reaches beyond its ends as far as is said, or ends in half discs") {
    const Polygon line{{-3, 0}, {2, 0}};
    CHECK(path_area(line, {.half_width = 0.5, .end = 2.0}) == Approx(7.0));
    CHECK(path_area(line, {.half_width = 0.5, .begin = 0.5, .end = 0.5}) == Approx(6.0));
    CHECK(path_area(line, {.half_width = 0.5, .begin = -1.0}) == Approx(4.0));
    CHECK(path_area({{-3, 0}, {-2, 0}, {-2, 4}}, {.half_width = 0.5, .begin = -2.0}) == Approx(3.0));
    CHECK(path_polygons(line, {.half_width = 0.5, .begin = -3.0, .end = -2.0}).empty());
    // Round ends keep within a thousandth of the radius of the arc: polygons of up to 1/750 less area and a
    // whole number of corners.
    CHECK(path_area({{-2, 0}, {2, 0}}, {.half_width = 1.5, .round = true}) ==
          Approx(12.0 + kHalfTurn * 2.25).epsilon(1.5e-3));
    CHECK(path_area({{0, 0}, {0.002, 0}}, {.half_width = 1.0, .round = true}) ==
          Approx(kHalfTurn).epsilon(3e-3));
    CHECK(path_area(arc(3.0, 180, 5), {.half_width = 1.0, .round = true}) ==
          Approx(6.0 * kHalfTurn + kHalfTurn).epsilon(2e-3));
}

TEST_CASE("a path of one point is a square or a disc, and one without width is nothing") {
    CHECK(path_area({{7, 8}}, {.half_width = 1.0, .begin = 1.0, .end = 1.0}) == Approx(4.0));
    CHECK(path_area({{7, 8}, {7, 8}}, {.half_width = 1.0, .begin = 0.0, .end = 3.0}) == Approx(6.0));
    CHECK(path_area({{7, 8}}, {.half_width = 1.0, .round = true}) == Approx(kHalfTurn).epsilon(1.5e-3));
    CHECK(path_polygons({{7, 8}}, {.half_width = 1.0}).empty());
    CHECK(path_polygons({{0, 0}, {1, 0}}, {.half_width = 0.0}).empty());
    CHECK(path_polygons({}, {.half_width = 1.0}).empty());
}

TEST_CASE("a path around an opening leaves it open") {
    const Polygon frame{{0, 0}, {4, 0}, {4, 4}, {0, 4}, {0, -0.5}};
    CHECK(path_area(frame, {.half_width = 0.5}) == Approx(25.0 - 9.0));
    CHECK(united(path_polygons(frame, {.half_width = 0.5})).size() == 2);
}

TEST_CASE(
    "a union counts overlaps and copies once, joins what touches and keeps holes behind their outline") {
    const std::vector<Polygon> overlapping{block(0, 0, 2, 2), block(1, 1, 3, 3), block(0, 0, 2, 2)};
    CHECK(area_of(united(overlapping)) == Approx(7.0));
    CHECK(united(overlapping).size() == 1);
    const std::vector<Polygon> halves{block(0, 0, 1, 1), {{1, 1}, {2, 1}, {2, 0}, {1, 0}}};
    REQUIRE(united(halves).size() == 1);
    CHECK(united(halves)[0].size() == 4);
    const Polygon slit{{0, 0}, {3, 0}, {3, 3}, {0, 3}, {0, 0}, {1, 1}, {1, 2}, {2, 2}, {2, 1}, {1, 1}};
    const auto ring = united(std::vector<Polygon>{slit, block(10, 0, 11, 1)});
    REQUIRE(ring.size() == 3);
    std::vector<double> areas;
    for (const Polygon& outline : ring) areas.push_back(signed_area(outline));
    const auto hole = std::find_if(areas.begin(), areas.end(), [](double a) { return a < 0.0; });
    REQUIRE((hole != areas.begin() && hole != areas.end()));
    CHECK(*std::prev(hole) == Approx(9.0));
    CHECK(*hole == Approx(-1.0));
    // Each polygon is filled by the even-odd rule: a pentagram has no middle, unless another one covers it.
    Polygon star;
    for (int k = 0; k < 5; ++k)
        star.push_back({std::cos(0.8 * kHalfTurn * k), std::sin(0.8 * kHalfTurn * k)});
    const double r = std::sin(0.1 * kHalfTurn) / std::sin(0.3 * kHalfTurn),
                 middle = 2.5 * r * r * std::sin(0.4 * kHalfTurn);
    CHECK(area_of(united(std::vector<Polygon>{star})) == Approx(signed_area(star) - 2.0 * middle));
    CHECK(area_of(united(std::vector<Polygon>{star, block(-r, -r, r, r)})) > signed_area(star) - middle);
    CHECK_THROWS_AS(
        united(std::vector<Polygon>{Polygon{{0, 0}, {1, std::numeric_limits<double>::infinity()}, {1, 1}}}),
        GeometryError);
}

TEST_CASE("a union of many polygons is what its rows are, in time that grows little faster than they do") {
    std::vector<Polygon> touching, apart, slabs;
    for (int i = 0; i < 200; ++i)
        for (int j = 0; j < 200; ++j) {
            touching.push_back(block(0.1 * i, 0.1 * j, 0.1 * (i + 1), 0.1 * (j + 1)));
            apart.push_back(block(i, j, i + 0.5, j + 0.5));
        }
    for (int k = 0; k < 40'000; ++k) slabs.push_back(block(k, -1e4, k + 0.5, 1e4));
    const auto whole = united(touching);
    CHECK(area_of(whole) == Approx(400.0));
    CHECK(whole.size() == 1);
    CHECK(united(apart).size() == 40'000);
    CHECK(united(slabs).size() == 40'000);
}

TEST_CASE("a polygon crosses itself where its edges do, and not where they touch") {
    CHECK_FALSE(self_crossing(block(0, 0, 1, 1)));
    CHECK_FALSE(
        self_crossing({{0, 0}, {3, 0}, {3, 3}, {0, 3}, {0, 0}, {1, 1}, {1, 2}, {2, 2}, {2, 1}, {1, 1}}));
    const auto tie = self_crossing({{-1, -1}, {1, 1}, {1, -1}, {-1, 1}});
    REQUIRE(tie);
    CHECK(std::hypot((*tie)[0], (*tie)[1]) < 1e-9);
    CHECK(self_crossing({{0, 0}, {4, 0}, {4, 4}, {1, 4}, {1, -1}, {0, -1}}));
}

TEST_CASE("the distance of outlines that touch or overlap has no seam between them") {
    Shape mask;
    mask.kind = ShapeKind::mask;
    mask.polygons = {block(-2, -1, 0, 1), block(0, -1, 2, 1), block(-1, -0.5, 1, 0.5)};
    const Outline distance = outline(mask, make_domain({8.0, 8.0}, 0.1, {Side::reflective, Side::periodic}));
    CHECK(distance(0.0, 0.0) == Approx(-1.0));
    CHECK(distance(0.0, 0.75) == Approx(-0.25));
    CHECK(distance(1.0, 0.5) == Approx(-0.5));
    CHECK(distance(0.0, 3.0) == Approx(2.0));
}
