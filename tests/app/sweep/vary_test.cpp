#include "app/sweep/vary.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "app/recipe/figure_names.hpp"
#include "surface/error.hpp"

using namespace sidewall;
using namespace sidewall::app;

namespace {

const std::string kVaried = R"(
[domain]
extent = [2.0, 1.0]
grid_spacing = 0.25
[[layer]]
material = "Si"
[[step]]
model = "single_particle"
rate = 1.0
sticking = 0.5
duration = 0.2
deposit = "SiO2"
)";

std::vector<Vary> vary(const std::vector<std::string>& texts) {
    return parse_vary(texts, parse_recipe(kVaried, "recipe.toml"));
}

}  // namespace

TEST_CASE(
    "each coordinate of the first 2^k Sobol points has one in each of 2^k equal parts, and pairs fill boxes") {
    for (const std::uint32_t count : {2u, 16u, 256u}) {
        for (std::size_t d = 0; d < kSobolDimensions; ++d) {
            std::vector<bool> taken(count, false);
            for (std::uint32_t i = 0; i < count; ++i) {
                const auto part = static_cast<std::size_t>(sobol(i, d) * count);
                REQUIRE(part < count);
                CHECK_FALSE(taken[part]);
                taken[part] = true;
            }
        }
    }
    // The first points, as published with the direction numbers.
    const double known[8][3] = {{0.5, 0.5, 0.5},       {0.75, 0.25, 0.25},      {0.25, 0.75, 0.75},
                                {0.375, 0.375, 0.625}, {0.875, 0.875, 0.125},   {0.625, 0.125, 0.875},
                                {0.125, 0.625, 0.375}, {0.1875, 0.3125, 0.9375}};
    for (std::uint32_t i = 0; i < 8; ++i)
        for (std::size_t d = 0; d < 3; ++d) CHECK(sobol(i + 1, d) == known[i][d]);
    // Any two coordinates: 1024 points in 8 x 8 boxes lie evenly within a factor of 2.
    for (std::size_t a = 0; a < kSobolDimensions; ++a)
        for (std::size_t b = 0; b < a; ++b) {
            std::vector<int> boxes(64, 0);
            for (std::uint32_t i = 0; i < 1024; ++i)
                ++boxes[static_cast<std::size_t>(8.0 * sobol(i, a)) * 8 +
                        static_cast<std::size_t>(8.0 * sobol(i, b))];
            INFO(a << " " << b);
            CHECK(*std::min_element(boxes.begin(), boxes.end()) >= 8);
            CHECK(*std::max_element(boxes.begin(), boxes.end()) <= 32);
        }
}

TEST_CASE("a grid is the product of ranges, linear or logarithmic, and lists, the last key fastest") {
    const auto points =
        grid_points(vary({"step[0].rate=0:1:3", "step[0].sticking=0.01:1:3:log", "step[0].deposit=Si,SiO2"}));
    REQUIRE(points.size() == 18);
    CHECK(points[0] == RunValues{"0", "0.01", "Si"});
    CHECK(points[1] == RunValues{"0", "0.01", "SiO2"});
    CHECK(points[2] == RunValues{"0", "0.1", "Si"});
    CHECK(points[17] == RunValues{"1", "1", "SiO2"});
    CHECK(grid_points(vary({"domain.extent=[1,2],[3,4]"})) == std::vector<RunValues>{{"[1,2]"}, {"[3,4]"}});
    CHECK(grid_points(vary({"step[0].rate=-4:-1:3:log"})) == std::vector<RunValues>{{"-4"}, {"-2"}, {"-1"}});
    CHECK(grid_points(vary({"simplify.method=none"})) == std::vector<RunValues>{{"none"}});
}

TEST_CASE("keys that hold whole numbers take whole numbers") {
    for (const RunValues& point : sobol_points(vary({"flux.rays=100:999:log"}), 7))
        CHECK(point[0].find_first_not_of("0123456789") == std::string::npos);
}

TEST_CASE("a longer Sobol design begins with the shorter one and stays within its bounds") {
    const auto varied = vary({"step[0].rate=2:3", "step[0].sticking=0.1,0.2,0.3"});
    const auto few = sobol_points(varied, 8), many = sobol_points(varied, 32);
    CHECK(std::equal(few.begin(), few.end(), many.begin()));
    for (const RunValues& point : many) {
        CHECK(std::stod(point[0]) > 2.0);
        CHECK(std::stod(point[0]) < 3.0);
        CHECK(point[1].starts_with("0."));
    }
}

TEST_CASE("what cannot be varied is refused by name") {
    for (const std::string text :
         {"", "=1:2", "a", "a=", "a=1:", "a=1:2:3:4", "a=1:2:log:3", "a=2:1", "a=1:1", "a=0:1:log",
          "a=-1:1:log", "a=1:2:1", "a=1:2:2.5", "a=1:nan", "a=1:inf", "a=1,,2", "a=1:2:99999"})
        CHECK_THROWS_AS(parse_vary(text), RecipeError);
    CHECK_THROWS_WITH(parse_vary("a=2:1"), Catch::Contains("a=2:1") && Catch::Contains("swap"));
    CHECK_THROWS_WITH(vary({"flux.rays=1,2", "flux.rays=3:4:2"}), Catch::Contains("twice"));
    CHECK_THROWS_AS(grid_points(vary({"step[0].rate=1:2"})), RecipeError);
    CHECK_THROWS_AS(grid_points(vary({"step[0].rate=1:2:200", "step[0].sticking=0:1:200"})), RecipeError);
    CHECK_THROWS_AS(sobol_points(vary({"step[0].rate=1:2:5"}), 4), RecipeError);
    CHECK_THROWS_AS(sobol_points(vary({"step[0].rate=1:2"}), 0), RecipeError);
}

TEST_CASE("a measure is asked for by its word or by the name of its figure") {
    Recipe recipe = parse_recipe(kVaried, "recipe.toml");
    want_measure(recipe, "step_coverage_side", "--measure");
    want_measure(recipe, "cd_at_0.25", "--measure");
    want_measure(recipe, "mean_rate", "--measure");
    CHECK(recipe.metrology.measures == std::vector<std::string>{"depth", "film", "cd"});
    CHECK(recipe.metrology.cd_depths == std::vector<double>{0.25});
    CHECK(word_of(recipe, "added_volume_SiO2"));
    CHECK_FALSE(word_of(recipe, "film"));
    CHECK_THROWS_WITH(want_measure(recipe, "step_coverge_side", "--measure"),
                      Catch::Contains("step_coverage_side?"));
    for (const std::string name :
         {"cd_at_", "cd_at_x", "cd_at_1.50", "cd_at_nan", "added_volume_Unobtainium", ""})
        CHECK_THROWS_AS(want_measure(recipe, name, "--measure"), RecipeError);
}
