#include <catch2/catch.hpp>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "app/evaluation/validate.hpp"
#include "app/recipe/recipe.hpp"
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

TEST_CASE("validate goes on where it was killed, and a part of the cases keeps the rows of the others") {
    const test::Folder folder;
    const auto run = [&](const std::string& arguments) {
        const auto outcome = test::run_program(folder.path, "validate -o out --json - " + arguments, 120);
        INFO(outcome.output);
        CHECK(outcome.exit_code == 0);
        return nlohmann::json::parse(outcome.output);
    };
    // Killed once the case itself is run and the next one has begun.
    test::run_command(
        folder.path,
        "true; '" SIDEWALL_PROGRAM
        "' validate -o out --case even_film </dev/null >log 2>&1 & p=$!; until "
        "[ -e out/even_film/summary.json ]; do sleep 0.02; done; kill -9 $p; wait $p 2>/dev/null");
    const auto bytes = [&] { return test::read_bytes(folder.path / "out/even_film/summary.json"); };
    const std::string before = bytes();
    const auto resumed = run("--case even_film --resume");
    CHECK(bytes() == before);  // its clock would tell
    CHECK(run("--case even_film --resume") == resumed);
    // The row of another case, as a run of all would have left it.
    auto report = resumed;
    const app::ValidationCase& other = app::validation_cases().front();
    REQUIRE(other.name != "even_film");
    auto row = resumed["cases"][0];
    row["name"] = other.name;
    row["recipe"] = other.recipe;
    row["readings"] = nlohmann::json::array();
    for (std::size_t k = 0; k < other.readings.size(); ++k)
        row["readings"].push_back(resumed["cases"][0]["readings"][0]);
    auto stale = row;  // of a recipe that the program no longer has
    stale["name"] = app::validation_cases()[1].name;
    report["cases"] = {stale, row};
    std::ofstream(folder.path / "out/validation.json") << report;
    const auto both = run("--case even_film --resume");
    REQUIRE(both["cases"].size() == 2);
    CHECK(both["cases"][0] == row);
    CHECK(both["cases"][1] == resumed["cases"][0]);
    CHECK(test::read_bytes(folder.path / "out/validation.md").find("\n## " + other.name + "\n") !=
          std::string::npos);
}

TEST_CASE("a case that validate does not know is refused by its name") {
    const test::Folder folder;
    const auto outcome = test::run_program(folder.path, "validate --case koh_pitt");
    CHECK(outcome.exit_code == 2);
    CHECK(outcome.output.find("did you mean koh_pit") != std::string::npos);
}
