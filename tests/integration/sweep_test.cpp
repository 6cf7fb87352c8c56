#include <map>
#include <set>
#include <sstream>
#include <vector>

#include "tests/integration/run_program.hpp"

using namespace sidewall::test;
namespace fs = std::filesystem;

namespace {

// A recipe that takes a tenth of a second.
const std::string kSwept = R"(
[domain]
extent = [4.0, 1.0]
grid_spacing = 0.25
boundary = ["reflective", "periodic"]
[[layer]]
material = "Si"
shape = "trench"
width = 2.0
depth = 2.0
[[step]]
model = "single_particle"
duration = 0.3
rate = 1.0
sticking = 0.3
deposit = "SiO2"
[flux]
rays = 2000
)";

const std::string kSobol =
    "sweep recipe.toml --vary 'step[0].sticking=0.1:1:log' --vary 'step[0].rate=0.5:1' --design sobol --runs 8 ";

struct SweepFolder : Folder {
    explicit SweepFolder(const std::string& text = kSwept) {
        std::ofstream(path / "recipe.toml", std::ios::binary) << text;
    }
    Outcome run(const std::string& arguments, int exit_code = 0) const {
        Outcome outcome = run_program(path, arguments);
        INFO(arguments << "\n" << outcome.output);
        CHECK(outcome.exit_code == exit_code);
        return outcome;
    }
};

// Rows of a table without quotes by column name.
std::vector<std::map<std::string, std::string>> table(const fs::path& file) {
    std::istringstream text(read_bytes(file));
    std::vector<std::string> names;
    std::vector<std::map<std::string, std::string>> rows;
    for (std::string line; std::getline(text, line);) {
        std::istringstream fields(line);
        std::map<std::string, std::string> row;
        std::size_t k = 0;
        for (std::string field; std::getline(fields, field, ','); ++k) {
            if (rows.empty() && !names.empty()) REQUIRE(k < names.size());
            row[names.size() > k ? names[k] : field] = field;
        }
        if (names.empty()) {
            std::istringstream header(line);
            for (std::string name; std::getline(header, name, ',');) names.push_back(name);
        } else {
            rows.push_back(row);
        }
    }
    return rows;
}

// The table without its seconds.
std::string table_text(const fs::path& file) {
    std::string text;
    for (auto row : table(file)) {
        row.erase("seconds");
        for (const auto& [name, value] : row) text += name + "=" + value + " ";
        text += "\n";
    }
    return text;
}

}  // namespace

TEST_CASE("a sweep killed and resumed ends with the table of one that was not", "[slow]") {
    const SweepFolder whole, killed;
    whole.run(kSobol + "-o out --jobs 2 --quiet");
    std::string resume;
    for (const char* seconds : {"0.15", "0.4", "0.3"}) {
        run_command(killed.path, "true; '" SIDEWALL_PROGRAM "' " + kSobol + "-o out --jobs 2 --quiet " +
                                     resume + "</dev/null >>log 2>&1 & p=$!; sleep " + seconds +
                                     "; kill -9 $p; wait $p 2>/dev/null");
        if (fs::exists(killed.path / "out/sweep.json")) resume = "--resume";
    }
    killed.run(kSobol + "-o out --jobs 2 " + resume);
    CHECK(table(whole.path / "out/sweep.csv").size() == 8);
    CHECK(table_text(whole.path / "out/sweep.csv") == table_text(killed.path / "out/sweep.csv"));
    // Finished runs are not repeated.
    const std::string before = read_bytes(whole.path / "out/sweep.csv");
    whole.run(kSobol + "-o out --resume");
    CHECK(read_bytes(whole.path / "out/sweep.csv") == before);
}

TEST_CASE("a sweep that is asked to stop ends with 130, leaves no process behind and says how to go on") {
    const SweepFolder c;
    const Outcome outcome = run_command(
        c.path,
        "true; '" SIDEWALL_PROGRAM "' " + kSobol +  // so that the program itself is in the background
            "--set flux.rays=200000 -o out --jobs 2 </dev/null >log 2>&1 & p=$!; until [ -e out/runs/0001/manifest.txt ]; do sleep 0.02; done; kill -INT $p; wait $p; "
            "echo status $?; cat log");
    CHECK_THAT(outcome.output, Catch::StartsWith("status 130\n"));
    CHECK_THAT(outcome.output, Catch::Contains("go on with: sidewall sweep recipe.toml --vary") &&
                                   Catch::Contains("--vary 'step[0].rate=0.5:1' --design sobol --runs 8") &&
                                   Catch::Contains("-o out --jobs 2 --resume"));
    for (const auto& run : fs::directory_iterator(c.path / "out/runs"))
        CHECK_FALSE(fs::exists(run.path() / ".sidewall.lock"));
}

TEST_CASE("a run that fails is a row with its message, and equal points share a run") {
    const SweepFolder c;
    // The second grid needs hundreds of gigabytes.
    const Outcome outcome = c.run(
        "sweep recipe.toml --set 'domain.extent=[4,4]' --vary domain.grid_spacing=0.5,0.00025,0.5 --measure film -o out");
    CHECK_THAT(outcome.output, Catch::Contains("run 0002 failed: "));
    CHECK_THAT(outcome.output, Catch::Contains("3 rows of 2 runs in out/sweep.csv, 1 failed"));
    const std::string csv = read_bytes(c.path / "out/sweep.csv");
    CHECK_THAT(csv, Catch::StartsWith("run,domain.grid_spacing,depth,film_top,film_side,"));
    CHECK_THAT(csv, Catch::Contains("\n0001,0.5,") && Catch::Contains(",ok\n0002,0.00025,,") &&
                        Catch::Contains("the run would need about"));
    CHECK(table(c.path / "out/sweep.csv").at(2).at("run") == "0001");
    CHECK_FALSE(fs::exists(c.path / "out/runs/0003"));
}

TEST_CASE("the commands of a sweep's plan, run by themselves, make its table") {
    const SweepFolder c;
    const std::string sweep = "sweep recipe.toml --vary 'step[0].sticking=0.2,0.4' ";
    c.run(sweep + "-o direct");
    const Outcome plan = c.run(sweep + "-o 'planned ones' --plan");
    CHECK_THAT(plan.output, Catch::StartsWith("sidewall run 'planned ones/runs/0001/recipe.toml' -o "));
    std::string script = "sidewall() { '" SIDEWALL_PROGRAM "' \"$@\" --quiet; }\n" + plan.output;
    CHECK(run_command(c.path, script).exit_code == 0);
    CHECK_FALSE(fs::exists(c.path / "planned ones/sweep.csv"));
    c.run(sweep + "-o 'planned ones' --resume");
    CHECK(table_text(c.path / "planned ones/sweep.csv") == table_text(c.path / "direct/sweep.csv"));
}

TEST_CASE("a sweep that cannot be run is refused before its first run") {
    const SweepFolder c;
    for (const auto& [arguments, message] : std::vector<std::pair<std::string, std::string>>{
             {"", "--vary: missing"},
             {"--vary 'step[0].stiking=0.1,0.2'",
              "--vary step[0].stiking=0.1: step[0].stiking = 0.1: unknown key"},
             {"--vary 'step[0].stiking=0.1,0.2'", "did you mean sticking?"},
             {"--vary 'step[0].sticking=0.5,0.7,1.4'", "must be in [0, 1]"},
             {"--vary 'step[0].sticking=1:0.1:4'",
              "the lower bound 1 must be below the upper one 0.1: swap them"},
             {"--vary 'step[2].sticking=0.1'", "the recipe has 1, counted from 0"},
             {"--vary 'step[0].rate=1,2' --measure dept",
              "--measure dept: no run measures that: did you mean depth?"},
             {"--vary 'step[0].rate=1,2' --runs 4", "--design sobol"},
             {"--vary 'step[0].rate=1:2' --design sobol", "--runs N"}}) {
        const Outcome outcome = c.run("sweep recipe.toml -o out " + arguments, 2);
        CHECK_THAT(outcome.output, Catch::Contains(message));
        CHECK_FALSE(fs::exists(c.path / "out"));
    }
    c.run("sweep recipe.toml -o out --vary 'step[0].rate=1,2'");
    CHECK_THAT(c.run("sweep recipe.toml -o out --vary 'step[0].rate=1,2'", 2).output,
               Catch::Contains("--resume"));
    CHECK_THAT(c.run("sweep recipe.toml -o out --vary 'step[0].rate=1,3' --resume", 2).output,
               Catch::Contains("holds another sweep, which differs in vary"));
    CHECK_THAT(c.run("sweep recipe.toml -o out/runs/0001 --vary 'step[0].rate=1,3'", 2).output,
               Catch::Contains("holds other results"));
    CHECK_THAT(c.run("sweep none.toml -o out2 --vary 'step[0].rate=1,3'", 3).output,
               Catch::Contains("no such file"));
}

TEST_CASE("a sweep does not take results of an edited table for its own") {
    const SweepFolder c;
    std::ofstream(c.path / "rates.csv") << "x,rate\n0,-1\n1,-2\n";
    test::write_table_recipe(c.path);
    const std::string plan = "sweep recipe.toml -o out --plan --vary step[0].duration=0.1,0.2";
    c.run(plan);
    c.run(plan + " --resume");
    std::ofstream(c.path / "rates.csv") << "x,rate\n0,-1\n1,-3\n";
    CHECK_THAT(c.run(plan + " --resume", 2).output,
               Catch::Contains("holds another sweep, which differs in files"));
}

TEST_CASE("every figure that a sweep can be asked for is a column of its table") {
    const SweepFolder c;
    c.run(
        "sweep recipe.toml --vary 'step[0].rate=1' --measure film --measure scallops --measure bow --measure undercut "
        "--measure aspect_ratio --measure sidewall_angle --measure cd_at_0.5 --measure cd_at_1 -o out");
    const auto rows = table(c.path / "out/sweep.csv");
    REQUIRE(rows.size() == 1);
    for (const char* name :
         {"depth", "film_top", "film_side", "film_bottom", "step_coverage_side", "step_coverage_bottom",
          "scallop_pitch", "scallop_depth", "bow", "undercut", "aspect_ratio", "sidewall_angle", "cd_at_0.5",
          "cd_at_1", "mean_rate", "added_volume_SiO2", "removed_volume_Si", "seconds", "status"})
        CHECK(rows[0].contains(name));
}
