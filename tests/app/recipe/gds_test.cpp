#include "app/recipe/layout/gds.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "app/recipe/layout/layout.hpp"
#include "surface/error.hpp"
#include "tests/app/recipe/gds_bytes.hpp"

using namespace sidewall;
using namespace sidewall::app;

namespace {

double area(const levelset::Polygon& polygon) {
    double sum = 0.0;
    for (std::size_t k = 0, j = polygon.size() - 1; k < polygon.size(); j = k++)
        sum += 0.5 * (polygon[j][0] * polygon[k][1] - polygon[k][0] * polygon[j][1]);
    return std::abs(sum);
}

std::vector<levelset::Polygon> flat(const Layout& layout, const std::string& cell, int layer, int datatype) {
    std::set<std::string> missing;
    return flatten(layout, cell, layer, datatype, missing);
}

// A square of 100 database units on layer 1/0 and a path on 2/5, in a cell that TOP places as a 3 x 2 array,
// and once more turned, mirrored and doubled.
std::string library() {
    return test::gds_library(
        test::gds_cell("UNIT", test::gds_boundary(1, 0, {0, 0, 100, 0, 100, 100, 0, 100, 0, 0}) +
                                   test::gds_path(2, 5, 20, {0, 0, 200, 0, 200, 50})) +
        test::gds_cell("TOP", test::gds_array("UNIT", 3, 2, {0, 0, 900, 0, 0, 800}) +
                                  test::gds_reference("UNIT", {5000, 0}, true, 2.0, 90.0)));
}

}  // namespace

TEST_CASE("a GDSII library gives its polygons back, placed, turned, mirrored and scaled", "[foreign]") {
    const Layout gds = parse_gds(library(), "memory");
    CHECK(gds.metres == Approx(1e-9).epsilon(1e-12));
    CHECK(top_cells(gds) == std::vector<std::string>{"TOP"});
    const auto squares = flat(gds, "TOP", 1, 0);
    REQUIRE(squares.size() == 7);
    for (std::size_t k = 0; k < 6; ++k) CHECK(area(squares[k]) == Approx(1e-14));
    CHECK(squares[5][0][0] == Approx(600e-9));
    CHECK(squares[5][0][1] == Approx(400e-9));
    CHECK(area(squares[6]) == Approx(4e-14));
    // Corner (100, 0): mirroring about x keeps it, 90 degrees turn it onto y; then it is doubled and moved.
    CHECK(squares[6][1][0] == Approx(5000e-9));
    CHECK(squares[6][1][1] == Approx(200e-9));
    CHECK(squares[6][3][0] == Approx(5200e-9));
    REQUIRE(flat(gds, "UNIT", 2, 5).size() == 1);
    CHECK(area(flat(gds, "UNIT", 2, 5)[0]) == Approx(250 * 20 * 1e-18));
    CHECK(flat(gds, "TOP", 7, 0).empty());
    CHECK_THROWS_AS(flat(gds, "ELSE", 1, 0), FileError);
    const Layout loop = parse_gds(test::gds_library(test::gds_cell("A", test::gds_reference("B", {0, 0})) +
                                                    test::gds_cell("B", test::gds_reference("A", {0, 0}))),
                                  "memory");
    CHECK_THROWS_AS(flat(loop, "A", 1, 0), FileError);
}

TEST_CASE("a damaged GDSII file is refused, wherever the damage is", "[foreign]") {
    const std::string good = library();
    for (std::size_t size = 0; size < good.size(); ++size)
        CHECK_THROWS_AS(parse_gds(std::string_view(good).substr(0, size), "cut"), FileError);
    // A file with one changed byte is refused or read as another layout, and does no harm.
    int refused = 0;
    for (std::size_t k = 0; k < good.size(); ++k)
        for (const int flip : {0x01, 0x80, 0xff}) {
            std::string bad = good;
            bad[k] = static_cast<char>(bad[k] ^ flip);
            try {
                const Layout gds = parse_gds(bad, "damaged");
                for (const auto& [name, cell] : gds.cells) flat(gds, name, 1, 0);
            } catch (const FileError&) {
                ++refused;
            }
        }
    CHECK(refused > 100);
    CHECK_THROWS_AS(parse_gds("not a layout at all", "text"), FileError);
}

TEST_CASE("a layout of any depth is flattened, and one that expands too far is refused before it does",
          "[foreign]") {
    const std::string square = test::gds_boundary(1, 0, {0, 0, 100, 0, 100, 100, 0, 100, 0, 0});
    std::string chain = test::gds_cell("C0", square);
    for (int k = 1; k < 100'000; ++k)
        chain +=
            test::gds_cell("C" + std::to_string(k), test::gds_reference("C" + std::to_string(k - 1), {1, 0}));
    const Layout deep = parse_gds(test::gds_library(chain), "deep.gds");
    const auto polygons = flat(deep, "C99999", 1, 0);
    REQUIRE(polygons.size() == 1);
    CHECK(polygons[0][0][0] == Approx(99999e-9));

    // A kilobyte of 9 nested arrays: 1e18 polygons on one layer, none on another.
    std::string nested = test::gds_cell("N0", square);
    for (int k = 1; k < 10; ++k)
        nested += test::gds_cell("N" + std::to_string(k),
                                 test::gds_array("N" + std::to_string(k - 1), 10, 10, {0, 0, 9, 0, 0, 9}));
    const Layout wide = parse_gds(test::gds_library(nested), "wide.gds");
    CHECK_THROWS_WITH(flat(wide, "N9", 1, 0),
                      Catch::Matchers::StartsWith("wide.gds: cell N9 becomes 4e+18 corners") &&
                          Catch::Matchers::Contains("2e+07 is the most"));
    CHECK(flat(wide, "N9", 2, 0).empty());
    CHECK(flat(wide, "N2", 1, 0).size() == 10'000);
    CHECK_THROWS_WITH(flat(wide, "ELSE", 1, 0), Catch::Matchers::StartsWith("wide.gds: "));
}

TEST_CASE("GDSII paths end as their type says, and an absolute width is not magnified", "[foreign]") {
    const auto path = [](int type, int width, const std::vector<int>& points, const std::string& more = "") {
        return test::gds_put(0x09, 0) + test::gds_short(0x0d, {1}) + test::gds_short(0x0e, {0}) +
               test::gds_short(0x21, {type}) + test::gds_long(0x0f, {width}) + more +
               test::gds_long(0x10, points) + test::gds_end();
    };
    const auto drawn = [](const std::string& elements, double magnification = 1.0) {
        const Layout gds =
            parse_gds(test::gds_library(
                          test::gds_cell("A", elements) +
                          test::gds_cell("TOP", test::gds_reference("A", {0, 0}, false, magnification, 0.0))),
                      "memory");
        return 1e18 * levelset::area_of(levelset::united(flat(gds, "TOP", 1, 0)));
    };
    const std::vector<int> line{-3000, 0, 2000, 0};
    const auto ends = [](int begin, int end) {
        return test::gds_long(0x30, {begin}) + test::gds_long(0x31, {end});
    };
    CHECK(drawn(path(0, 1000, line)) == Approx(5e6));
    CHECK(drawn(path(1, 1000, line)) == Approx(5e6 + 0.25e6 * std::numbers::pi).epsilon(1e-3));
    CHECK(drawn(path(2, 1000, line)) == Approx(6e6));
    CHECK(drawn(path(4, 1000, line, ends(0, 2000))) == Approx(7e6));
    CHECK(drawn(path(4, 1000, line, ends(0, 0))) == Approx(5e6));
    CHECK(drawn(path(4, 1000, line, ends(-1000, 500))) == Approx(4.5e6));
    CHECK(drawn(path(2, 2000, {5, 5})) == Approx(4e6));
    CHECK(drawn(path(1, 2000, {5, 5})) == Approx(std::numbers::pi * 1e6).epsilon(1.5e-3));
    CHECK(drawn(path(0, 2000, {5, 5})) == 0.0);
    // The last piece is shorter than half the width.
    CHECK(drawn(path(0, 1000, {-3000, 0, 2000, 0, 2000, 200})) == Approx(5.2e6));
    CHECK(drawn(path(0, -1000, {-3000, 0, 2000, 0, 2000, 200}), 2.0) == Approx(10.4e6));
    CHECK(drawn(path(4, 1000, {2000, 100, 2000, 0, -3000, 0}, ends(100, 0))) == Approx(5.2e6));
    // Scaled: length and width; length alone (negative width); length alone, with square ends.
    CHECK(drawn(path(0, 1000, line), 2.0) == Approx(20e6));
    CHECK(drawn(path(0, -1000, line), 2.0) == Approx(10e6));
    CHECK(drawn(path(2, -1000, line), 3.0) == Approx(16e6));
}

TEST_CASE("KLayout's context cell is no layout, and a cell that the file lacks is told", "[foreign]") {
    const std::string square = test::gds_boundary(1, 0, {0, 0, 100, 0, 100, 100, 0, 100, 0, 0});
    const std::string part = test::gds_cell("PART", square),
                      context = test::gds_cell("$$$CONTEXT_INFO$$$", test::gds_reference("PART", {0, 0}));
    const std::string top = test::gds_cell(
        "TOP", test::gds_reference("PART", {300, 300}) + test::gds_reference("ELSEWHERE", {0, 0}) + square);
    const Layout with_top = parse_gds(test::gds_library(part + top + context), "memory"),
                 without = parse_gds(test::gds_library(context + part), "memory");
    CHECK(top_cells(with_top) == std::vector<std::string>{"TOP"});
    CHECK(top_cells(without) == std::vector<std::string>{"PART"});
    std::set<std::string> missing;
    CHECK(flatten(with_top, "TOP", 1, 0, missing).size() == 2);
    CHECK(missing == std::set<std::string>{"ELSEWHERE"});
    // Cells missing below a placed cell and in an array are reported, also for a layer that draws nothing.
    const Layout deep = parse_gds(
        test::gds_library(test::gds_cell("CHILD", square + test::gds_reference("LOST", {0, 0})) +
                          test::gds_cell("TOP", test::gds_array("GONE", 3, 2, {0, 0, 900, 0, 0, 800}) +
                                                    test::gds_array("CHILD", 3, 2, {0, 0, 900, 0, 0, 800}))),
        "memory");
    missing.clear();
    CHECK(flatten(deep, "TOP", 1, 0, missing).size() == 6);
    CHECK(missing == std::set<std::string>{"GONE", "LOST"});
    missing.clear();
    CHECK(flatten(deep, "TOP", 2, 0, missing).empty());
    CHECK(missing == std::set<std::string>{"GONE", "LOST"});
}
