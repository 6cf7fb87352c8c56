#include <signal.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "tests/integration/program.hpp"

using namespace sidewall::test;
namespace fs = std::filesystem;

namespace {

// Every surface that a run saved, by name.
std::vector<std::pair<std::string, std::string>> surfaces(const fs::path& folder) {
    std::vector<std::pair<std::string, std::string>> files;
    for (const auto& entry : fs::directory_iterator(folder)) {
        const std::string name = entry.path().filename().string();
        if (name.starts_with("surface_") || name.starts_with("interface_") || name.starts_with("profile_"))
            files.emplace_back(name, read_bytes(entry.path()));
    }
    std::sort(files.begin(), files.end());
    return files;
}

std::size_t lines(const fs::path& path) {
    const std::string text = read_bytes(path);
    return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

const std::string kRecipe = config("quick/trench_deposition.toml") + " --set flux.rays=20000";

}  // namespace

TEST_CASE("the same recipe gives the same bytes: again, with 1 and 2 threads, and interrupted and resumed") {
    const Folder folder;
    // The last carries coverages from step to step, so through the checkpoint, too.
    for (const std::string& recipe :
         {kRecipe + " --set simplify.method=none", kRecipe + " --set simplify.method=region",
          kRecipe + " --set flux.reuse=0.1 --set flux.stages=midpoint",
          kRecipe + " --set flux.stages=all --set advection.time_integration=rk3",
          config("quick/sf6o2_hole.toml") + " --set flux.rays=10000"}) {
        for (const std::string run : {"first", "again", "one"}) {
            const auto outcome = run_program(
                folder.path,
                "run " + recipe + " -o " + run + (run == "one" ? " --threads 1" : " --threads 2"), 120);
            INFO(outcome.output);
            REQUIRE(outcome.exit_code == 0);
        }
        const auto expected = surfaces(folder.path / "first");
        REQUIRE(expected.size() >= 6);
        CHECK(surfaces(folder.path / "again") == expected);
        CHECK(surfaces(folder.path / "one") == expected);

        // Interrupted as soon as the timeline shows some steps, then resumed.
        const fs::path stopped = folder.path / "stopped";
        const std::string start = "cd '" + folder.path.string() + "' && exec '" SIDEWALL_PROGRAM "' run " +
                                  recipe + " -o stopped >stopped.log 2>&1 </dev/null";
        const pid_t child = fork();
        REQUIRE(child >= 0);
        if (child == 0) {
            execl("/bin/sh", "sh", "-c", start.c_str(), static_cast<char*>(nullptr));
            _exit(127);
        }
        for (int tick = 0;
             tick < 6000 && (!fs::exists(stopped / "timeline.csv") || lines(stopped / "timeline.csv") < 3);
             ++tick)
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        kill(child, SIGINT);
        int status = 0;
        waitpid(child, &status, 0);
        INFO(read_bytes(folder.path / "stopped.log"));
        REQUIRE(WIFEXITED(status));
        REQUIRE(WEXITSTATUS(status) == 130);
        CHECK_FALSE(fs::exists(stopped / "summary.json"));
        const auto resumed = run_program(folder.path, "run " + recipe + " -o stopped --resume", 120);
        INFO(resumed.output);
        REQUIRE(resumed.exit_code == 0);
        CHECK(surfaces(stopped) == expected);
        CHECK(lines(stopped / "timeline.csv") == lines(folder.path / "first" / "timeline.csv"));
        for (const char* run : {"first", "again", "one", "stopped"}) fs::remove_all(folder.path / run);
    }
}

TEST_CASE("a checkpoint of another recipe is refused") {
    const Folder folder;
    REQUIRE(run_program(folder.path, "run " + kRecipe + " --set step[0].duration=0.1 -o out", 60).exit_code ==
            0);
    const auto outcome = run_program(folder.path, "run " + kRecipe + " -o out --resume", 60);
    CHECK(outcome.exit_code == 3);
    CHECK(outcome.output.find("run without --resume") != std::string::npos);
}

TEST_CASE("a run leaves everything the format promises") {
    const Folder folder;
    const auto outcome = run_program(folder.path, "run " + kRecipe + " -o out", 60);
    REQUIRE(outcome.exit_code == 0);
    for (const char* name : {"summary.json", "timeline.csv", "surface.pvd", "surface_0000.vtp",
                             "checkpoint.vdb", "recipe.toml", "profile_0000.csv"})
        CHECK(fs::exists(folder.path / "out" / name));
    const auto summary = nlohmann::json::parse(read_bytes(folder.path / "out" / "summary.json"));
    for (const char* key : {"version", "recipe", "seed", "threads", "steps", "timing", "mesh", "metrology"})
        CHECK(summary.contains(key));
    for (const char* phase : {"extract", "features", "simplify", "bvh", "trace", "rates", "extend", "advect",
                              "redistance", "output", "total"})
        CHECK(summary["timing"][phase].is_number());
    CHECK(summary["mesh"]["simplified"]["vertices"] < summary["mesh"]["raw"]["vertices"]);
    // A second run into the same folder starts afresh: no surface of a longer run stays behind.
    REQUIRE(run_program(folder.path, "run " + kRecipe + " --set step[0].duration=0.1 -o out", 60).exit_code ==
            0);
    CHECK_FALSE(fs::exists(folder.path / "out" / "surface_0002.vtp"));
}

TEST_CASE("compare ends with a table of raw, Lindstrom-Turk and region, and the noise floor") {
    const Folder folder;
    const auto outcome = run_program(folder.path, "compare " + kRecipe + " -o out", 240);
    INFO(outcome.output);
    REQUIRE(outcome.exit_code == 0);
    for (const char* word : {"raw", "lindstrom-turk", "region", "region-bounded", "noise floor", "trace [s]",
                             "triangles", "distance max [dx]"})
        CHECK(outcome.output.find(word) != std::string::npos);
    const auto json = nlohmann::json::parse(read_bytes(folder.path / "out" / "compare.json"));
    REQUIRE(json["variants"].size() == 4);
    CHECK(json["variants"][0]["final"]["hausdorff_max"] == 0.0);
    for (std::size_t simplified = 1; simplified < 4; ++simplified)
        CHECK(json["variants"][simplified]["mesh"]["simplified"]["triangles"] <
              json["variants"][0]["mesh"]["simplified"]["triangles"]);
    CHECK(json["noise_floor"]["hausdorff_mean"] > 0.0);
}
