#include <algorithm>
#include <catch2/catch.hpp>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/integration/run_program.hpp"

// The workbench as a whole: its page in a browser, and its runs as processes.
namespace {

using Json = nlohmann::ordered_json;
using sidewall::test::Folder;
using sidewall::test::Outcome;
using sidewall::test::run_command;
using sidewall::test::run_program;

Outcome run_script(const Folder& folder, const std::string& name) {
    return run_command(
        folder.path, "timeout -k 5 800 /usr/bin/python3 '" SIDEWALL_SOURCE_DIR "/tests/integration/" + name +
                         "' '" SIDEWALL_PROGRAM "' '" + folder.path.string() + "' 2>&1");
}

bool holds(const Json& texts, const std::string& text) {
    return std::find(texts.begin(), texts.end(), text) != texts.end();
}

const std::string kRecipe = R"([domain]
extent = [2.0, 1.0]
grid_spacing = 0.05
[[layer]]
material = "Si"
shape = "trench"
width = 1.0
depth = 1.0
[[step]]
model = "isotropic"
duration = 2.0
rate = 0.1
deposit = "SiO2"
[advection]
cfl = 0.005
)";

}  // namespace

TEST_CASE(
    "in a browser the workbench names a mistake, draws the wafer, runs, stops, resumes, compares and fits",
    "[slow]") {
    const Folder folder;
    const Outcome outcome = run_script(folder, "workbench_browser.py");
    if (outcome.exit_code == 77) {
        WARN("skipped: " << outcome.output);
        return;
    }
    INFO(outcome.output);
    REQUIRE(outcome.exit_code == 0);
    const Json page = Json::parse(outcome.output);
    CHECK(page["errors"].empty());
    CHECK(page["problem"].get<std::string>().find("did you mean width?") != std::string::npos);
    CHECK(page["problem_below"] == true);
    CHECK(page["at_fault"] == "wdith");
    CHECK(page["no_toml_at"] == true);
    CHECK(page["completed"].get<std::string>().find("width") != std::string::npos);
    CHECK(page["highlighted"] > 20);
    CHECK(page["corner"].get<std::string>().find("grid") != std::string::npos);
    CHECK(page["offered"][1] > 20);  // recipes that came with the program,
    CHECK(page["offered"][2] > 20);  // and chemistries
    CHECK(page["wafer_changed"] == true);
    CHECK(page["findings"].get<std::string>().find("Blanket rates") != std::string::npos);
    CHECK(page["help"].get<std::string>().find("step[0].duration") != std::string::npos);
    CHECK(page["after_leaving"] == "running");
    CHECK(page["frames_while_running"].size() >= 3);
    CHECK(page["seen_after"][0] == Approx(page["seen_before"][0].get<double>()).epsilon(0.01));
    CHECK(page["seen_after"][1] == page["seen_before"][1]);
    CHECK(page["curves_while_running"] > 2);
    CHECK(page["charts"].size() > 5);
    const auto label = page["last_alone"][0].get<std::string>();  // "t = 0.4 s", of the checkpoint
    CHECK(label != "t = 0 s");
    CHECK(page["last_alone"][1].get<std::string>().find(" time " + label.substr(4, label.rfind(' ') - 4) +
                                                        " alone") != std::string::npos);
    CHECK(holds(page["compared"], "results/trench"));
    CHECK(holds(page["compared"], "results/trench-2"));
    CHECK(holds(page["differs"], "step[0].duration"));
    CHECK(page["dots"] >= 5);
    CHECK(page["fitted"][0] == "step[0].sticking");
    CHECK(page["fitted"][1] == Approx(0.5).margin(0.05));  // in the recipe that made the profile
    CHECK(page["swept"].get<std::string>().find("Response curves") != std::string::npos);
    const auto drawn = page["drawn"].get<std::string>(), twice = page["drawn_twice"].get<std::string>();
    CHECK(
        drawn.find(
            "\n\n[[layer]]\nmaterial = \"Resist\"\nshape = \"mask\"\nthickness = 0.2\npolygons = [{ points = [-0.") ==
        0);
    CHECK(twice.find(drawn.substr(0, drawn.size() - 1)) == 0);
    CHECK(std::count(twice.begin(), twice.end(), '{') == 2);
    CHECK(page["undone"] == true);
    CHECK(page["by_fields"] ==
          "\n\n[[layer]]\nmaterial = \"Resist\"\nshape = \"mask\"\nthickness = 0.2\nopenings = false\n"
          "polygons = [{ points = [-0.5, -0.2, 0.25, -0.2, 0.25, 0.3, -0.5, 0.3] }]");
    CHECK(page["interval"].get<std::string>().find(
              "\n\n[[layer]]\nmaterial = \"Resist\"\nshape = \"trench\"\nthickness = 0.2\nwidth = ") == 0);
    CHECK(page["conflict"] == "- # theirs\n+ # mine\n");
    CHECK(page["kept"] == "# mine\n");
    CHECK(page["run_refused"].get<std::string>().find("small.toml has changed on the disk") == 0);
    CHECK(page["choices_elsewhere"] == 0);
    CHECK(page["removed"].get<std::string>().find("removed") != std::string::npos);
    CHECK(page["anew"] == "# mine\n");
    CHECK(page["longest_silence"] < 20'000);  // ms, the drawing of a report among them
    CHECK(page["masks"] == 1);
    CHECK(page["latin"].get<std::string>().find("UTF-8") != std::string::npos);
    CHECK(page["still_open"] == "masked.toml");
    CHECK(page["chemistry"] == true);
    for (const Json& width : page["widths"]) CHECK(width[0] <= width[1]);
    CHECK(page["grounds"][0] != page["grounds"][1]);
    CHECK(page["stops"].size() > 6);
    CHECK(page["strangers_status"] == 403);
    CHECK(page["address_bar"].get<std::string>().find("key") == std::string::npos);
    CHECK(page["width"][0] <= page["width"][1]);
    CHECK(page["elsewhere"].empty());
    CHECK(page["memory_kb"] < 100'000);
    CHECK(page["exit_code"] == 0);
}

TEST_CASE("a run outlives the workbench that started it, and page and command line go on with each other's",
          "[slow]") {
    const Folder folder;
    std::ofstream(folder.path / "recipe.toml") << kRecipe;
    std::ofstream(folder.path / "other.toml") << kRecipe << "[flux]\nseed = 2\n";
    const Outcome outcome = run_script(folder, "workbench_runs.py");
    INFO(outcome.output);
    REQUIRE(outcome.exit_code == 0);
    const Json runs = Json::parse(outcome.output);
    CHECK(runs["after_kill"] == "running");
    CHECK(runs["damaged_answered"] > 300);  // the server drops the others
    CHECK(runs["went_on"] == true);
    CHECK(runs["asked"] == true);
    CHECK(runs["checkpoint"] == true);
    CHECK(runs["asked_again"] == false);
    CHECK(runs["resumed"] == 0);
    CHECK(runs["at_last"] == "finished");
    CHECK(runs["log"].get<std::string>().find("--overwrite") != std::string::npos);
    CHECK(runs["wrong_line"] == 1);
    CHECK(runs["sweep_stopped"] == "stopped");
    CHECK(runs["sweep_at_last"] == "finished");
    CHECK(runs["kinds"] == Json::array({"study", "validation"}));
    CHECK(runs["exit_code"] == 0);
}

TEST_CASE("a recipe's page has the wafer that it begins with, and runs stand side by side on one page") {
    const Folder folder;
    std::ofstream(folder.path / "recipe.toml") << kRecipe;
    const Outcome read = run_command(folder.path, "'" SIDEWALL_PROGRAM "' report - --json - <recipe.toml");
    const Json page = Json::parse(read.output);
    CHECK(page["kind"] == "recipe");
    CHECK(page["sections"][0]["type"] == "view");
    CHECK(page["sections"][0]["frames"].size() == 1);
    for (const char* rate : {"0.1", "0.2"})
        REQUIRE(
            run_program(folder.path,
                        std::string("run recipe.toml --quiet --set advection.cfl=0.5 --set step[0].rate=") +
                            rate + " --set step[0].duration=0.5 -o run" + rate)
                .exit_code == 0);
    REQUIRE(run_program(folder.path, "report run0.1 run0.2 --json both.json").exit_code == 0);
    const Json both = Json::parse(sidewall::test::read_bytes(folder.path / "both.json"));
    const Json& table = both["sections"][0];
    CHECK(table["columns"][1]["name"] == "step[0].rate");
    CHECK(table["rows"][0][1] == 0.1);
    CHECK(table["rows"][1][1] == 0.2);
    CHECK(both["sections"][1]["frames"].size() == 2);
    for (const char* wrong : {"run0.1", "run0.1 run0.2 --last -o a.html", "recipe.toml run0.1 -o a.html",
                              "- --step 1 -o a.html"}) {
        CAPTURE(wrong);
        CHECK(run_program(folder.path, std::string("report ") + wrong).exit_code == 2);
    }
}
