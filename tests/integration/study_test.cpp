#include <catch2/catch.hpp>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/folder.hpp"
#include "tests/integration/run_program.hpp"

using namespace sidewall::test;

namespace {

void write_recipe(const std::filesystem::path& path, const char* shape) {
    std::ofstream(path)
        << "[domain]\nextent = [4.0, 4.0]\ngrid_spacing = 0.25\n\n[[layer]]\nmaterial = \"Si\"\n"
        << shape
        << "\n[[step]]\nmodel = \"single_particle\"\nduration = 0.3\nrate = 1.0\nsticking = 0.5\n"
           "deposit = \"SiO2\"\n\n[flux]\nrays = 20000\n\n[simplify]\nmethod = \"none\"\n";
}

}  // namespace

TEST_CASE("study compares every method at equal numbers of vertices and writes its report") {
    const Folder folder;
    write_recipe(folder.path / "surface1.toml", "shape = \"fin\"\nwidth = 2.0\nheight = 1.0\n");
    write_recipe(folder.path / "surface2.toml", "shape = \"hole\"\nradius = 1.2\ndepth = 6.0\n");
    const auto outcome = run_program(folder.path, "study --quick --rays 20000 --recipes . -o out", 240);
    INFO(outcome.output);
    REQUIRE(outcome.exit_code == 0);
    CHECK(outcome.output.find("Verdicts") != std::string::npos);
    for (const char* file : {"report.md", "study.csv", "surface1_region_simplified.vtp",
                             "surface2_lindstrom-turk-0.5-0.5-0_simplified.vtp"})
        CHECK(std::filesystem::exists(folder.path / "out" / file));
    const auto study = nlohmann::json::parse(std::ifstream(folder.path / "out" / "study.json"));
    REQUIRE(study["surfaces"].size() == 2);
    for (const auto& surface : study["surfaces"]) {
        REQUIRE(surface["rows"].size() == 10);
        for (const auto& row : surface["rows"]) {
            CHECK(row["trace"]["seconds"]["trace"].get<double>() > 0.0);
            if (row["method"] == "raw") continue;
            const double target = (1.0 - row["removal"].get<double>()) * surface["vertices"].get<double>();
            INFO(row["method"] << " at " << row["removal"]);
            // Exactly as many vertices as asked for, or a handful fewer: a collapse takes one.
            CHECK(row["vertices"].get<double>() <= target + 1.0);
            CHECK(row["vertices"].get<double>() >= target - 0.01 * target - 2.0);
            CHECK(row["original_to_simplified"]["max"].get<double>() >=
                  row["original_to_simplified"]["mean"].get<double>());
        }
    }
}

TEST_CASE("study grows its surfaces on a grid of as many levels as it is told to, and says so") {
    const Folder folder;
    write_recipe(folder.path / "surface1.toml", "shape = \"fin\"\nwidth = 2.0\nheight = 1.0\n");
    const auto outcome = run_program(
        folder.path, "study --quick --surface 1 --grid-levels 2 --rays 2000 --recipes . -o out", 240);
    INFO(outcome.output);
    REQUIRE(outcome.exit_code == 0);
    CHECK(outcome.output.find("They come from a grid of several levels") != std::string::npos);
    const auto study = nlohmann::json::parse(std::ifstream(folder.path / "out" / "study.json"));
    const auto& levels = study["surfaces"][0]["grid"]["levels"];
    REQUIRE(levels.size() == 2);
    CHECK(levels[1]["spacing"].get<double>() == Approx(2.0 * levels[0]["spacing"].get<double>()));
}

TEST_CASE("study says where it looked for its recipes") {
    const Folder folder;
    const auto outcome = run_program(folder.path, "study --recipes nowhere -o out", 60);
    CHECK(outcome.exit_code == 3);
    CHECK(outcome.output.find("nowhere/surface1.toml") != std::string::npos);
    CHECK(outcome.output.find("--recipes") != std::string::npos);
}
