#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/integration/run_program.hpp"

using namespace sidewall::test;
namespace fs = std::filesystem;
using nlohmann::json;

namespace {

// A blanket etch without fluxes, whose depth is rate times duration on any grid, beside a trench that widens
// by as much on both sides.
const std::string kEtch = R"(
[domain]
extent = [4.0]
grid_spacing = 0.1
[[layer]]
material = "Si"
shape = "trench"
width = 1.5
depth = 1.13
[[step]]
model = "isotropic"
duration = 1.0
rate = { Si = -0.37 }
)";

const std::string kFilm = R"(
[domain]
extent = [4.0]
grid_spacing = 0.2
[[layer]]
material = "Si"
shape = "trench"
width = 2.0
depth = 2.0
[[step]]
model = "single_particle"
duration = 0.5
rate = 1.0
sticking = 0.3
deposit = "SiO2"
[flux]
rays = 2000
)";

struct Case : Folder {
    explicit Case(const std::string& text) { std::ofstream(path / "recipe.toml", std::ios::binary) << text; }
    Outcome run(const std::string& arguments, int exit_code = 0) const {
        Outcome outcome = run_program(path, "run recipe.toml -o out " + arguments, 120);
        INFO(arguments << "\n" << outcome.output);
        CHECK(outcome.exit_code == exit_code);
        return outcome;
    }
    json summary() const { return json::parse(read_bytes(path / "out/summary.json")); }
};

}  // namespace

TEST_CASE("bars of depth and opening of an etch known exactly hold them, and are as small as asked for") {
    const Case c(kEtch);
    const Outcome outcome = c.run("--accuracy depth=2% --accuracy cd_at_0.6=0.05");
    CHECK_THAT(outcome.output,
               Catch::Contains("simplification") && Catch::Contains("times the one settled on"));
    const json summary = c.summary();
    for (const auto& [measure, exact, asked] :
         {std::tuple("depth", 1.13 + 0.37, 0.02 * 1.5), std::tuple("cd_at_0.6", 1.5 + 2.0 * 0.37, 0.05)}) {
        const json bars = summary["accuracy"][measure];
        INFO(measure << " " << bars.dump());
        CHECK(bars["status"] == "reached");
        CHECK(bars["asked"].get<double>() == Approx(asked).epsilon(0.02));
        CHECK(bars["total"].get<double>() <= bars["asked"].get<double>());
        CHECK(std::abs(bars["value"].get<double>() - exact) <= bars["total"].get<double>());
        CHECK(bars["noise"] == 0.0);
        CHECK(bars["value"] == summary["metrology"][measure]);
    }
    // The folder is that of an ordinary run, on the grid settled on.
    CHECK(fs::exists(c.path / "out/surface.pvd"));
    CHECK(summary["accuracy_runs"].size() >= 2);
    CHECK(summary["accuracy"]["mean_rate"]["status"] == "known");
}

TEST_CASE("a run to an accuracy that was killed goes on to the same bars", "[slow]") {
    const std::string paths = kFilm + "method = \"monte-carlo\"\n";  // a profile has no noise by radiosity
    const Case whole(paths), killed(paths);
    const std::string asked = "--accuracy film_bottom=12% --quiet ";
    whole.run(asked);
    run_command(
        killed.path,
        "true; nice -n 19 '" SIDEWALL_PROGRAM "' run recipe.toml -o out " + asked +
            "</dev/null >log 2>&1 & p=$!; until set -- out/accuracy/*/summary.json; [ -e \"$1\" ]; do :; done; kill -9 $p; wait $p 2>/dev/null");
    CHECK_THAT(killed.run(asked, 2).output, Catch::Contains("--resume"));
    killed.run(asked + "--resume");
    const auto without_seconds = [](json summary) {
        summary.erase("timing");
        summary.erase("accuracy_seconds");
        summary.erase("threads");
        for (json& run : summary["accuracy_runs"]) run.erase("seconds");
        return summary;
    };
    CHECK(without_seconds(whole.summary()) == without_seconds(killed.summary()));
    // Resuming a finished run changes nothing.
    const std::string before = read_bytes(whole.path / "out/checkpoint.vdb");
    whole.run(asked + "--resume");
    CHECK(read_bytes(whole.path / "out/checkpoint.vdb") == before);
    const json bars = whole.summary()["accuracy"]["film_bottom"];
    INFO(bars.dump());
    for (const char* part : {"grid", "noise", "simplification"}) CHECK(bars[part].get<double>() > 0.0);
}

TEST_CASE(
    "another run in its folder removes the records of one to an accuracy, and nothing that runs have not written") {
    const Case c(kFilm);
    c.run("--accuracy film_bottom=50% --quiet");
    const fs::path records = c.path / "out/accuracy";
    REQUIRE(fs::exists(records / "grid_1/summary.json"));
    REQUIRE(fs::exists(records / "seed_2/surface_0000.vtp"));
    for (const char* name : {"grid_1/notes.txt", "mine/summary.json", "summary.json"}) {
        fs::create_directories((records / name).parent_path());
        std::ofstream(records / name) << "mine";
    }
    c.run("--accuracy film_bottom=40% --quiet --overwrite");
    CHECK(fs::exists(records / "seed_2/surface_0000.vtp"));
    // A run of the user's own that is not named like a record.
    fs::copy(records / "seed_2", c.path / "out/accuracy/fine", fs::copy_options::recursive);
    c.run("--quiet --overwrite");
    CHECK(fs::exists(records / "fine/surface_0000.vtp"));
    fs::remove_all(records / "fine");
    std::set<std::string> left;
    for (const auto& entry : fs::recursive_directory_iterator(records))
        left.insert(fs::relative(entry.path(), records).string());
    CHECK(left ==
          std::set<std::string>{"grid_1", "grid_1/notes.txt", "mine", "mine/summary.json", "summary.json"});
    fs::remove_all(records);
    c.run("--accuracy film_bottom=50% --quiet --overwrite");
    c.run("--quiet --overwrite");
    CHECK_FALSE(fs::exists(records));
}

TEST_CASE("a run to an accuracy goes on to another one, up and down, and makes damaged records again") {
    const Case etch(kEtch + "[metrology]\nmeasures = [\"cd\"]\ncd_depths = [0.5]\n");
    for (const char* bound : {"20%", "2%", "20%", "5%"}) {
        etch.run(std::string("--accuracy cd_at_0.5=") + bound + " --resume");
        CHECK(etch.summary()["accuracy"]["cd_at_0.5"]["status"] == "reached");
    }
    for (const auto& entry : fs::recursive_directory_iterator(etch.path / "out/accuracy"))
        if (entry.path().filename() == "summary.json" &&
            entry.path().parent_path().filename().string().starts_with("grid_")) {
            json record = json::parse(read_bytes(entry.path()));
            record.erase("events");
            record["timing"] = json::object();
            std::ofstream(entry.path()) << record;
        }
    etch.run("--accuracy cd_at_0.5=2% --resume");
    CHECK(etch.summary()["accuracy"]["cd_at_0.5"]["status"] == "reached");
}

TEST_CASE("a run to an accuracy goes on with its own runs alone, and says so") {
    const Case c(kEtch);
    const std::string asked = "--accuracy depth=20% --quiet --resume";
    c.run("--quiet");
    const std::string plain = read_bytes(c.path / "out/checkpoint.vdb");
    CHECK_THAT(c.run(asked, 2).output, Catch::Contains("out: holds a run that --accuracy cannot go on with"));
    CHECK(read_bytes(c.path / "out/checkpoint.vdb") == plain);
    c.run("--accuracy depth=20% --quiet --overwrite");
    CHECK_THAT(c.run(asked + " --set step[0].rate.Si=-0.4", 2).output, Catch::Contains("cannot go on with"));
    CHECK_THAT(c.run("--quiet --resume", 3).output, Catch::Contains("repeat its --accuracy"));
    c.run(asked);
}

TEST_CASE("grids too coarse for the wafer are passed over, again when going on") {
    const std::string narrow = kEtch + "[metrology]\nmeasures = [\"depth\"]\n";
    const Case etch(narrow);
    const std::string coarse = "--set domain.extent=[1.2] --set layer[0].width=0.7 ";
    etch.run(coarse + "--accuracy depth=20%");
    etch.run(coarse + "--accuracy depth=20% --resume");
    etch.run(coarse + "--accuracy depth=20% --overwrite");
}

TEST_CASE("what a finer grid refuses is told with the line of the user's file, which the run ends before") {
    const Case c(kFilm + "averaging = 1.5\n");
    const Outcome outcome = c.run("--accuracy film_bottom=0.1%");
    CHECK_THAT(outcome.output, Catch::Contains("recipe.toml:18: flux.averaging = 1.5: must be 0, or"));
}

TEST_CASE("what an accuracy cannot be asked of is refused, and what cannot be known is said", "[foreign]") {
    const Case c(kEtch);
    for (const auto& [asked, message] : std::vector<std::pair<std::string, std::string>>{
             {"dept=1%", "--accuracy dept: no run measures that: did you mean depth?"},
             {"depth", "write MEASURE=BOUND"},
             {"depth=", "is no number"},
             {"depth=fine", "fine is no number"},
             {"depth=0", "must be greater than 0"},
             {"depth=0%", "must be greater than 0"},
             {"depth=-1%", "must be greater than 0"},
             {"depth=nan", "is no number"},
             {"depth=100%", "below 100 %"},
             {"film=1%", "name one, e.g. film_side"},
             {"depth=1% --accuracy depth=2%", "asked for twice"}}) {
        CHECK_THAT(c.run("--accuracy " + asked, 2).output, Catch::Contains(message));
        CHECK_FALSE(fs::exists(c.path / "out"));
    }
    c.run("--accuracy cd_at_3=1% --accuracy added_volume_Si=1% --quiet");
    const json accuracy = c.summary()["accuracy"];
    CHECK(accuracy["cd_at_3"]["status"] == "unknown");
    CHECK(accuracy["cd_at_3"]["total"].is_null());
    CHECK_THAT(accuracy["cd_at_3"]["reason"].get<std::string>(), Catch::Contains("does not have it"));
    CHECK(accuracy["added_volume_Si"]["status"] == "unknown");
    CHECK_THAT(accuracy["added_volume_Si"]["reason"].get<std::string>(), Catch::Contains("absolute"));
}
