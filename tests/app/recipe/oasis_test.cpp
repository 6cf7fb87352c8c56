#include "app/recipe/layout/oasis.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "app/recipe/layout/layout.hpp"
#include "surface/error.hpp"
#include "tests/app/recipe/gds_bytes.hpp"
#include "tests/app/recipe/oasis_bytes.hpp"

using namespace sidewall;
using namespace sidewall::app;

namespace {

std::string place_at(std::int64_t x, std::int64_t y) {
    return test::oas_signed(x) + test::oas_signed(y);
}

// The polygons of layer \p layer in cell TOP, in nanometres.
std::vector<levelset::Polygon> drawn_in(const std::string& bytes, int layer = 1) {
    std::set<std::string> missing;
    auto polygons = flatten(parse_layout(bytes, "memory"), "TOP", layer, 0, missing);
    for (auto& polygon : polygons)
        for (auto& p : polygon)
            for (double& x : p) x = std::round(x * 1e12) / 1e3;
    return polygons;
}

// The polygons that these elements of cell TOP draw.
std::vector<levelset::Polygon> drawn_of(const std::string& elements, int layer = 1) {
    return drawn_in(test::oas_library(test::oas_cell("TOP", elements)), layer);
}

double area_in(const std::vector<levelset::Polygon>& polygons) {
    return levelset::area_of(levelset::united(polygons));
}

// Rectangles of 10 x 7 by their lower left corners.
levelset::Polygon places_of(const std::string& repetition) {
    levelset::Polygon places;
    for (const auto& polygon : drawn_of(test::oas_rectangle(10, 7, 0, 0, repetition)))
        places.push_back(polygon[0]);
    return places;
}

}  // namespace

TEST_CASE("an OASIS file gives its rectangles, polygons, paths and circles back", "[foreign]") {
    using test::oas_delta, test::oas_numbers, test::oas_record, test::oas_signed;
    const auto box = drawn_of(test::oas_rectangle(30, 20, 5, -6));
    REQUIRE(box.size() == 1);
    CHECK(box[0] == levelset::Polygon{{5, -6}, {35, -6}, {35, 14}, {5, 14}});
    // A field that is left out keeps its last value; a square has one length.
    const auto squares = drawn_of(oas_record(20, 0xdb, oas_numbers({1, 0, 30}) + place_at(5, 6)) +
                                  oas_record(20, 0x10, oas_signed(50)));
    REQUIRE(squares.size() == 2);
    CHECK(squares[1] == levelset::Polygon{{50, 6}, {80, 6}, {80, 36}, {50, 36}});
    const auto polygon = [&](const std::string& points) {
        const auto drawn = drawn_of(oas_record(21, 0x3b, oas_numbers({1, 0}) + points + place_at(-50, 60)));
        REQUIRE(drawn.size() == 1);
        return drawn[0];
    };
    CHECK(polygon(oas_numbers({0, 2}) + oas_signed(50) + oas_signed(30)) ==
          levelset::Polygon{{-50, 60}, {0, 60}, {0, 90}, {-50, 90}});
    CHECK(polygon(oas_numbers({1, 2}) + oas_signed(50) + oas_signed(30)) ==
          levelset::Polygon{{-50, 60}, {-50, 110}, {-20, 110}, {-20, 60}});
    CHECK(polygon(oas_numbers({2, 2, 50 << 2, 30 << 2 | 1})) ==
          levelset::Polygon{{-50, 60}, {0, 60}, {0, 90}});
    CHECK(polygon(oas_numbers({3, 2, 50 << 3, 20 << 3 | 5})) ==
          levelset::Polygon{{-50, 60}, {0, 60}, {-20, 80}});
    CHECK(polygon(oas_numbers({4, 2}) + oas_delta(50, 3) + oas_numbers({30 << 4 | 5 << 1})) ==
          levelset::Polygon{{-50, 60}, {0, 63}, {-30, 93}});
    CHECK(polygon(oas_numbers({5, 2}) + oas_delta(50, 0) + oas_delta(-60, 30)) ==
          levelset::Polygon{{-50, 60}, {0, 60}, {-10, 90}});
    // Half the width is 5. Ends: flush; extended by half the width; by 11 and -4.
    const auto path = [&](const std::string& scheme) {
        return area_in(drawn_of(oas_record(22, 0xfb,
                                           oas_numbers({1, 0, 5}) + scheme + oas_numbers({4, 2}) +
                                               oas_delta(60, 0) + oas_delta(40, 30) + place_at(7, 8))));
    };
    CHECK(path(oas_numbers({1 << 2 | 1})) == Approx(1100.0));
    CHECK(path(oas_numbers({2 << 2 | 1})) == Approx(1150.0));
    CHECK(path(oas_numbers({3 << 2 | 3}) + oas_signed(11) + oas_signed(-4)) == Approx(1170.0));
    CHECK(area_in(drawn_of(oas_record(27, 0x3b, oas_numbers({1, 0, 1000}) + place_at(5, 6)))) ==
          Approx(std::numbers::pi * 1e6).epsilon(1.5e-3));
}

TEST_CASE("trapezoids of an OASIS file are drawn as their forms say", "[foreign]") {
    using test::oas_numbers, test::oas_record, test::oas_signed;
    // Expected is what KLayout draws.
    CHECK(drawn_of(oas_record(
              23, 0x7b, oas_numbers({1, 0, 100, 60}) + oas_signed(13) + oas_signed(-17) + place_at(0, 0))) ==
          std::vector<levelset::Polygon>{levelset::Polygon{{13, 60}, {83, 60}, {100, 0}, {0, 0}}});
    CHECK(drawn_of(oas_record(24, 0x7b, oas_numbers({1, 0, 100, 60}) + oas_signed(-13) + place_at(0, 0))) ==
          std::vector<levelset::Polygon>{levelset::Polygon{{0, 60}, {100, 60}, {100, 0}, {13, 0}}});
    CHECK(area_in(drawn_of(
              oas_record(25, 0xfb, oas_numbers({1, 0, 100, 60}) + oas_signed(17) + place_at(0, 0)))) ==
          Approx(100.0 * 60.0 - 100.0 * 17.0 / 2.0));
    const double areas[26] = {2550, 2550, 2550, 2550, 2100,  2100,  2100, 2100, 2550,
                              2550, 2550, 2550, 2100, 2100,  2100,  2100, 5000, 5000,
                              5000, 5000, 900,  900,  10000, 10000, 3000, 10000};
    for (std::uint64_t type = 0; type < 26; ++type) {
        const bool tall = type >= 8 && type < 16;
        const auto drawn = drawn_of(oas_record(
            26, 0xfb, oas_numbers({1, 0, type, tall ? 30U : 100U, tall ? 100U : 30U}) + place_at(0, 0)));
        REQUIRE(drawn.size() == 1);
        CHECK(std::abs(levelset::signed_area(drawn[0])) == areas[type]);
    }
}

TEST_CASE("each repetition of OASIS stands where its type says", "[foreign]") {
    using test::oas_delta, test::oas_numbers;
    CHECK(places_of(oas_numbers({1, 1, 0, 20, 30})) ==
          levelset::Polygon{{0, 0}, {20, 0}, {40, 0}, {0, 30}, {20, 30}, {40, 30}});
    CHECK(places_of(oas_numbers({2, 0, 20})) == levelset::Polygon{{0, 0}, {20, 0}});
    CHECK(places_of(oas_numbers({3, 0, 20})) == levelset::Polygon{{0, 0}, {0, 20}});
    CHECK(places_of(oas_numbers({4, 1, 20, 35})) == levelset::Polygon{{0, 0}, {20, 0}, {55, 0}});
    CHECK(places_of(oas_numbers({5, 1, 5, 3, 7})) == levelset::Polygon{{0, 0}, {15, 0}, {50, 0}});
    CHECK(places_of(oas_numbers({6, 1, 20, 35})) == levelset::Polygon{{0, 0}, {0, 20}, {0, 55}});
    CHECK(places_of(oas_numbers({7, 1, 5, 3, 7})) == levelset::Polygon{{0, 0}, {0, 15}, {0, 50}});
    CHECK(places_of(oas_numbers({8, 0, 0}) + oas_delta(20, -15) + oas_delta(-40, 33)) ==
          levelset::Polygon{{0, 0}, {20, -15}, {-40, 33}, {-20, 18}});
    CHECK(places_of(oas_numbers({9, 1}) + oas_delta(-21, 5)) ==
          levelset::Polygon{{0, 0}, {-21, 5}, {-42, 10}});
    CHECK(places_of(oas_numbers({10, 1}) + oas_delta(20, 15) + oas_delta(-40, 33)) ==
          levelset::Polygon{{0, 0}, {20, 15}, {-20, 48}});
    CHECK(places_of(oas_numbers({11, 0, 3}) + oas_delta(20, 15)) == levelset::Polygon{{0, 0}, {60, 45}});
    // Repetition type 0 repeats the last one.
    CHECK(drawn_of(test::oas_rectangle(10, 7, 0, 0, oas_numbers({2, 8, 20})) +
                   test::oas_rectangle(10, 7, 0, 90, oas_numbers({0})))
              .size() == 20);
}

TEST_CASE("cells of an OASIS file are placed by name or number, relatively or not, packed or not",
          "[foreign]") {
    using test::oas_number, test::oas_numbers, test::oas_record, test::oas_signed;
    const std::string sub = oas_numbers({13, 7}) + test::oas_rectangle(40, 10, 1, 2);
    const std::string top = test::oas_cell(
        "TOP", oas_record(17, 0xf0, oas_number(7) + place_at(0, 0)) + oas_number(16) +
                   oas_record(17, 0x30 | 0x02, place_at(200, 0)) +
                   oas_record(17, 0x20 | 0x01, oas_signed(300)) +
                   oas_record(18, 0x38 | 0x06,
                              oas_numbers({0, 2, 0, 90}) + place_at(500, 50) + oas_numbers({2, 0, 300})));
    const std::string name = oas_numbers({4}) + test::oas_text("SUB") + oas_number(7);
    for (const std::string& records : {sub + top + name, name + test::oas_block(sub + top),
                                       test::oas_block(sub) + top + test::oas_block(name)}) {
        const auto drawn = drawn_in(test::oas_library(records));
        REQUIRE(drawn.size() == 5);
        CHECK(drawn[0][0] == std::array{1.0, 2.0});
        CHECK(drawn[1][0] == std::array{198.0, 1.0});  // turned by 90 degrees
        CHECK(drawn[2][2] == std::array{541.0, -12.0});
        CHECK(drawn[3][0] == std::array{996.0, 52.0});
        CHECK(drawn[4][0] == std::array{1296.0, 52.0});
    }
    // Texts, properties and names are skipped; a relative position adds to the last one.
    const std::string ballast =
        oas_record(19, 0x5b, test::oas_text("label") + oas_numbers({3, 4}) + place_at(9, 9)) +
        oas_record(28, 0x25,
                   test::oas_text("key") + oas_numbers({10}) + test::oas_text("v") + oas_numbers({4, 1, 3})) +
        oas_number(29) + oas_number(0);
    const auto relative = drawn_of(oas_number(16) + test::oas_rectangle(10, 10, 5, 6) + ballast +
                                   oas_record(20, 0x18, place_at(20, 1)));
    REQUIRE(relative.size() == 2);
    CHECK(relative[1][0] == std::array{25.0, 7.0});
}

TEST_CASE("layouts are known by their bytes: GDSII and OASIS, plain and in gzip", "[foreign]") {
    const std::string gds = test::gds_library(test::gds_cell(
                          "TOP", test::gds_boundary(1, 0, {0, 0, 10, 0, 10, 10, 0, 10, 0, 0}))),
                      oasis = test::oas_library(test::oas_cell("TOP", test::oas_rectangle(10, 10, 0, 0)));
    for (const std::string& bytes : {gds, oasis, test::gzip_of(gds), test::gzip_of(oasis)}) {
        CHECK(area_in(drawn_in(bytes)) == Approx(100.0));
        CHECK_THROWS_AS(drawn_in(bytes.substr(0, 40)), FileError);
    }
    CHECK_THROWS_WITH(drawn_in("<?xml version"), Catch::Contains("neither GDSII nor OASIS"));
    const std::string half = gds.substr(0, 40), members = test::gzip_of(half) + test::gzip_of(gds.substr(40));
    CHECK(area_in(drawn_in(members)) == Approx(100.0));
    CHECK_THROWS_WITH(drawn_in(test::gzip_of(test::gzip_of(gds))), Catch::Contains("packed twice"));
}

TEST_CASE("a damaged OASIS file is refused, and so by name is what OASIS leaves to others", "[foreign]") {
    using test::oas_number, test::oas_numbers, test::oas_record;
    const std::string elements =
        test::oas_rectangle(10, 7, 0, 0,
                            oas_numbers({10, 1}) + test::oas_delta(20, 15) + test::oas_delta(1, 2)) +
        oas_record(
            21, 0x3b,
            oas_numbers({1, 0, 4, 2}) + test::oas_delta(9, 1) + test::oas_delta(0, 5) + place_at(0, 0));
    const std::string good = test::oas_library(
        test::oas_cell("A", elements) +
        test::oas_block(test::oas_cell("TOP", oas_record(17, 0xb0, test::oas_text("A") + place_at(0, 0)))));
    CHECK(drawn_in(good).size() == 4);
    const std::size_t end = good.size() - 256;
    for (std::size_t size = 0; size <= end; ++size)
        CHECK_THROWS_AS(drawn_in(good.substr(0, size)), FileError);
    int refused = 0;
    for (std::size_t k = 0; k < end; ++k)
        for (const int flip : {0x01, 0x80, 0xff}) {
            std::string bad = good;
            bad[k] = static_cast<char>(bad[k] ^ flip);
            try {
                drawn_in(bad);
            } catch (const FileError&) {
                ++refused;
            }
        }
    CHECK(refused > 50);
    const auto message = [](const std::string& records) {
        try {
            drawn_in(test::oas_library(records));
        } catch (const FileError& error) {
            return std::string(error.what());
        }
        return std::string("accepted");
    };
    const std::string xgeometry =
        oas_record(33, 0x1b, oas_numbers({1, 1, 0}) + test::oas_text("?") + place_at(0, 0));
    CHECK_THAT(message(test::oas_cell("TOP", xgeometry)), Catch::Contains("XGEOMETRY"));
    CHECK_THAT(message(test::oas_cell("TOP", oas_record(20, 0x18, place_at(0, 0)))),
               Catch::Contains("omits a value"));
    CHECK_THAT(message(oas_numbers({34, 1, 5, 5})), Catch::Contains("another method"));
    CHECK_THAT(message(test::oas_cell("TOP", oas_number(99))), Catch::Contains("unknown type"));
    CHECK_THAT(message(oas_numbers({13, 5})), Catch::Contains("cell number 5 has no name"));
    CHECK_THAT(message(test::oas_cell(
                   "TOP", test::oas_rectangle(1, 1, 0, 0, oas_numbers({1, 1U << 30U, 1U << 30U, 2, 2})))),
               Catch::Contains("2e+07 is the most"));
}
