#include "app/fit/fit_profile.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>

#include "surface/error.hpp"
#include "tests/folder.hpp"

using namespace sidewall;
using namespace sidewall::app;
using Eigen::Vector2d;
using sidewall::test::Folder;

namespace {

// A trench's profile: 4 deep, walls at -1 and 1.5.
const Contour kTrench{{{Vector2d(-5, 0), Vector2d(-1, 0)}},
                      {{Vector2d(-1, 0), Vector2d(-1, -4)}},
                      {{Vector2d(-1, -4), Vector2d(1.5, -4)}},
                      {{Vector2d(1.5, -4), Vector2d(1.5, 0)}},
                      {{Vector2d(1.5, 0), Vector2d(5, 0)}}};

std::string written(const Folder& folder, const std::string& text) {
    const std::string path = (folder.path / "sem.csv").string();
    std::ofstream(path, std::ios::binary) << text;
    return path;
}

}  // namespace

TEST_CASE("distances from a profile have one sign in the gas and the other in the material") {
    const std::vector<Vector2d> gas{{0, -1}, {-3, 0.5}, {1.2, -3.9}, {-1.5, 2.0}},
        material{{-2, -1}, {0, -4.5}, {4, -0.25}, {-1.3, -4.4}};
    const auto above = distance_to(kTrench, gas, {}), below = distance_to(kTrench, material, {});
    REQUIRE((above && below));
    const double expected[] = {1.0, 0.5, 0.1, 2.0}, other[] = {1.0, 0.5, 0.25, 0.5};
    for (Eigen::Index i = 0; i < 4; ++i) {
        CHECK(above->signed_distances[i] == Approx(expected[i]));
        CHECK(below->signed_distances[i] == Approx(-other[i]));
    }
    CHECK_FALSE(distance_to({}, gas, {}));
}

TEST_CASE("the offset of a part of a profile is found, in the directions that are free") {
    std::vector<Vector2d> points;
    for (int i = 0; i < 200; ++i) {  // a wall, the floor and a part of the top, in turn and from all over
        const double t = std::fmod(0.618034 * i, 1.0);
        points.push_back(i % 3 == 0   ? Vector2d(-1, -4 * t)
                         : i % 3 == 1 ? Vector2d(-1 + 2.5 * t, -4)
                                      : Vector2d(1.5 + 2 * t, 0));
    }
    for (Vector2d& p : points) p += Vector2d(0.7, -0.4);
    const auto found = distance_to(kTrench, points, {.x = true, .z = true});
    REQUIRE(found);
    CHECK(found->offset.x() == Approx(-0.7).margin(1e-6));
    CHECK(found->offset.y() == Approx(0.4).margin(1e-6));
    CHECK(found->signed_distances.lpNorm<Eigen::Infinity>() < 1e-6);
    CHECK(distance_to(kTrench, points, {.x = true})->offset.y() == 0.0);
    CHECK(distance_to(kTrench, points, {})->offset.norm() == 0.0);
}

TEST_CASE("profiles are read whatever separates their columns, and named ones are found", "[foreign]") {
    const Folder folder;
    for (const char* text :
         {"1,2\n3,4\n5,6\n", "x,z\n1,2\n3,4\n5,6",
          "# from the SEM\r\nz [um];x [um]\r\n2;1\r\n4;3\r\n\r\n6;5\r\n", "1 2\n  3   4 # end\n5\t6\n",
          "z [nm];x [nm]\n2000;1e3\n4000;3e3\n6000;5e3\n",
          "\xef\xbb\xbfname\tx (nm)\tz\na\t1000\t2000\nb\t3000\t4000\n\t5000\t6000\n",
          "x [um],z [um],polyline\n1,2,0\n3,4,0\n5,6,1\n", "\"n\",\"x\",\"z\"\n7,1,2\n8,3,4\n9,+5,6\n"}) {
        const MeasuredProfile profile = read_measured_profile(written(folder, text), "um");
        INFO(text);
        REQUIRE(profile.points.size() == 3);
        CHECK(profile.points[0].isApprox(Vector2d(1, 2), 1e-14));
        CHECK(profile.points[2].isApprox(Vector2d(5, 6), 1e-14));
        CHECK_FALSE(profile.time);
    }
    const std::string path = written(folder, "1,2\n3,4\n5,6\n");
    CHECK(read_measured_profile(path + "@2.5", "um").time == 2.5);
    CHECK_THROWS_AS(read_measured_profile(path + "@soon", "um"), RecipeError);
    CHECK_THROWS_AS(read_measured_profile(path + "@-1", "um"), RecipeError);
}

TEST_CASE("what is no profile is refused with its line", "[foreign]") {
    const Folder folder;
    for (const auto& [text, message] : std::vector<std::pair<std::string, std::string>>{
             {"", "no row of numbers"},
             {"1,2\n3,4\n", "has 2 points"},
             {"1,2,3\n3,4,5\n5,6,7\n", "has 3 columns without headings"},
             {"x [px],z [px]\n1,2\n3,4\n5,6\n", "says px, which is no length unit"},
             {"x,z\n1,2\n3,4 nm\n5,6\n", "sem.csv:3: \"4 nm\" in z"},
             {"x,z\n1,2\n3,\n5,6\n", "sem.csv:3: \"\" in z is not"},
             {"1,2\nnan,4\n5,6\n", "sem.csv:2: \"nan\" in column 1"},
             {"1,2\n3,1e999\n5,6\n", "sem.csv:2: \"1e999\" in column 2"},
             {"1\n2\n3\n", "sem.csv: has 1 columns"},
             {std::string("\0\xff\x80\n,,,\n", 8), "sem.csv"}})
        CHECK_THROWS_WITH(read_measured_profile(written(folder, text), "um"), Catch::Contains(message));
    std::string many;
    for (int i = 0; i < 6000; ++i) many += "1,2\n";
    CHECK_THROWS_WITH(read_measured_profile(written(folder, many), "um"), Catch::Contains("over 5000 rows"));
}
