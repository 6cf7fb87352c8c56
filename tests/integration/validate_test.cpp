#include <catch2/catch.hpp>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "app/recipe/recipe.hpp"
#include "app/study/validate.hpp"
#include "tests/integration/program.hpp"

using namespace sidewall;

TEST_CASE(
    "every case of validate has a source, figures and a recipe that is good on twice the spacing, too") {
    std::set<std::string> names;
    for (const app::ValidationCase& one : app::validation_cases()) {
        INFO(one.name);
        CHECK(names.insert(one.name).second);
        CHECK_FALSE(one.source.empty());
        CHECK_FALSE(one.readings.empty());
        const app::Recipe recipe = app::parse_recipe(one.recipe, one.name + ".toml");
        CHECK_NOTHROW(
            app::parse_recipe(one.recipe, one.name + ".toml",
                              {"domain.grid_spacing=" + std::to_string(2.0 * recipe.domain.grid_spacing)}));
    }
    CHECK(names.size() >= 12);
}

TEST_CASE("the guide's page of validation has every case, and no other") {
    const std::string page = test::read_bytes(SIDEWALL_SOURCE_DIR "/docs/validation.md");
    std::size_t headings = 0;
    for (std::size_t at = page.find("\n## "); at != std::string::npos; at = page.find("\n## ", at + 1))
        ++headings;
    CHECK(headings == app::validation_cases().size() + 1);  // and what is left out
    for (const app::ValidationCase& one : app::validation_cases()) {
        INFO(one.name);
        CHECK(page.find("\n## " + one.name + "\n") != std::string::npos);
    }
}

TEST_CASE("validate runs a case on two grids and tells what it finds, with source and bars") {
    const test::Folder folder;
    const auto outcome = test::run_program(folder.path, "validate --case even_film -o out --json -", 120);
    INFO(outcome.output);
    REQUIRE(outcome.exit_code == 0);
    const auto found = nlohmann::json::parse(outcome.output);
    REQUIRE(found["cases"].size() == 1);
    const auto& one = found["cases"][0];
    CHECK(one["name"] == "even_film");
    CHECK_FALSE(one["source"].get<std::string>().empty());
    REQUIRE(one["readings"].size() == 3);
    const double dx = one["grid_spacing"].get<double>();
    // Flats lie within a tenth of a grid spacing; an opening has two walls.
    CHECK(std::abs(one["readings"][0]["deviation"].get<double>()) < 0.1 * dx);
    CHECK(std::abs(one["readings"][1]["deviation"].get<double>()) < 0.2 * dx);
    for (const auto& reading : one["readings"]) {
        const double bars = reading["noise"].get<double>() + reading["grid"].get<double>() +
                            reading["reference_bar"].get<double>();
        const double deviation = std::abs(reading["deviation"].get<double>());
        // The bars are printed to two digits.
        if (std::abs(deviation - bars) > 0.05 * bars) CHECK(reading["within_bars"] == (deviation <= bars));
    }
    CHECK(std::filesystem::exists(folder.path / "out" / "validation.md"));
    CHECK(nlohmann::json::parse(test::read_bytes(folder.path / "out" / "validation.json")) == found);
}

TEST_CASE("a case that validate does not know is refused by its name") {
    const test::Folder folder;
    const auto outcome = test::run_program(folder.path, "validate --case koh_pitt");
    CHECK(outcome.exit_code == 2);
    CHECK(outcome.output.find("did you mean koh_pit") != std::string::npos);
}
