#include <signal.h>

#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "tests/integration/run_program.hpp"

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

const std::string kQuickTrench = config("quick/trench_deposition.toml") + " --set flux.rays=20000";

}  // namespace

TEST_CASE("the same recipe gives the same bytes: again, with 1 and 2 threads, and interrupted and resumed",
          "[slow]") {
    const Folder folder;
    // The last recipe carries coverages from step to step, hence through the checkpoint.
    for (const std::string& recipe :
         {kQuickTrench + " --set simplify.method=none", kQuickTrench + " --set simplify.method=region",
          kQuickTrench + " --set flux.reuse=0.1",
          kQuickTrench + " --set flux.stages=all --set advection.time_integration=rk3",
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

        // The run is interrupted as soon as the timeline shows some steps, then resumed.
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
        const std::string log = read_bytes(folder.path / "stopped.log");
        INFO(log);
        REQUIRE(WIFEXITED(status));
        REQUIRE(WEXITSTATUS(status) == 130);
        CHECK_FALSE(fs::exists(stopped / "summary.json"));
        // Resumed by the very command that the message gives.
        const std::string hint = "go on with: sidewall ";
        REQUIRE(log.find(hint) != std::string::npos);
        const auto resumed = run_program(folder.path, log.substr(log.find(hint) + hint.size()), 120);
        INFO(resumed.output);
        REQUIRE(resumed.exit_code == 0);
        CHECK(surfaces(stopped) == expected);
        CHECK(lines(stopped / "timeline.csv") == lines(folder.path / "first" / "timeline.csv"));
        for (const char* run : {"first", "again", "one", "stopped"}) fs::remove_all(folder.path / run);
    }
}

TEST_CASE("a checkpoint of another recipe is refused") {
    const Folder folder;
    const std::string recipe = "run " + kQuickTrench + " --set step[0].duration=0.1 -o out";
    REQUIRE(run_program(folder.path, recipe, 60).exit_code == 0);
    const auto seed = run_program(folder.path, recipe + " --set flux.seed=7 --resume", 60);
    CHECK(seed.exit_code == 3);
    CHECK(seed.output.find("flux.seed = 7 (there 1)") != std::string::npos);
    const auto spacing = run_program(folder.path, recipe + " --set domain.grid_spacing=0.4 --resume", 60);
    CHECK(spacing.exit_code == 3);
    CHECK(spacing.output.find("domain.grid_spacing = 0.4 (there 0.5)") != std::string::npos);
}

TEST_CASE("a run leaves everything the format promises") {
    const Folder folder;
    const auto outcome = run_program(folder.path, "run " + kQuickTrench + " -o out", 60);
    REQUIRE(outcome.exit_code == 0);
    for (const char* name : {"summary.json", "timeline.csv", "surface.pvd", "surface_0000.vtp",
                             "checkpoint.vdb", "recipe.toml", "profile_0000.csv", "manifest.txt"})
        CHECK(fs::exists(folder.path / "out" / name));
    const auto summary = nlohmann::json::parse(read_bytes(folder.path / "out" / "summary.json"));
    for (const char* key : {"version", "recipe", "seed", "threads", "steps", "timing", "mesh", "metrology"})
        CHECK(summary.contains(key));
    for (const char* phase : {"extract", "features", "simplify", "bvh", "trace", "rates", "extend", "advect",
                              "redistance", "output", "total"})
        CHECK(summary["timing"][phase].is_number());
    CHECK(summary["mesh"]["simplified"]["vertices"] < summary["mesh"]["raw"]["vertices"]);
    // A second run into the same folder starts afresh: no surface of a longer run stays behind.
    REQUIRE(
        run_program(folder.path, "run " + kQuickTrench + " --set step[0].duration=0.1 -o out --overwrite", 60)
            .exit_code == 0);
    CHECK_FALSE(fs::exists(folder.path / "out" / "surface_0002.vtp"));
}

TEST_CASE("a damaged summary of a finished run is refused by name, and written anew once it is removed",
          "[slow]") {
    const Folder folder;
    const std::string command = "run " + kQuickTrench + " --set step[0].duration=0.1 -o out";
    REQUIRE(run_program(folder.path, command, 60).exit_code == 0);
    const fs::path file = folder.path / "out" / "summary.json";
    const auto whole = nlohmann::ordered_json::parse(read_bytes(file));
    std::vector<std::string> damaged{"", "{", "null", "3", "[]", "{}"};
    // Each part that is read is missing, or something else.
    for (const char* part :
         {"/version", "/time", "/time_unit", "/time_steps", "/grid_spacing", "/mesh", "/mesh/raw",
          "/mesh/simplified/triangles", "/timing", "/timing/total", "/metrology", "/metrology_units",
          "/metrology_units/mean_rate", "/events", "/steps"}) {
        const nlohmann::ordered_json::json_pointer at(part);
        for (const auto& other : {nlohmann::ordered_json(true), nlohmann::ordered_json("x"),
                                  nlohmann::ordered_json(1), nlohmann::ordered_json::array({1})}) {
            auto json = whole;
            if (json[at].type() == other.type() || (json[at].is_number() && other.is_number())) continue;
            json[at] = other;
            damaged.push_back(json.dump());
        }
        auto json = whole;
        json[at.parent_pointer()].erase(at.back());
        damaged.push_back(json.dump());
    }
    for (const std::string& text : damaged) {
        std::ofstream(file, std::ios::binary) << text;
        const auto outcome = run_program(folder.path, command + " --resume");
        INFO(text << "\n" << outcome.output);
        REQUIRE(outcome.exit_code == 3);
        CHECK(outcome.output.find("out/summary.json: is ") != std::string::npos);
        CHECK(outcome.output.find("remove it, and run --resume writes it anew") != std::string::npos);
    }
    fs::remove(file);
    REQUIRE(run_program(folder.path, command + " --resume", 60).exit_code == 0);
    auto again = nlohmann::ordered_json::parse(read_bytes(file));
    again["timing"] = whole["timing"];
    CHECK(again == whole);
}

TEST_CASE("resuming a finished run changes nothing") {
    const Folder folder;
    const std::string command = "run " + kQuickTrench + " --set step[0].duration=0.1 -o out";
    REQUIRE(run_program(folder.path, command, 60).exit_code == 0);
    const auto files = [&] {
        std::map<std::string, std::string> bytes;
        for (const auto& entry : fs::directory_iterator(folder.path / "out"))
            bytes[entry.path().filename().string()] = read_bytes(entry.path());
        return bytes;
    };
    const auto before = files();
    const auto outcome = run_program(folder.path, command + " --resume", 60);
    CHECK(outcome.exit_code == 0);
    CHECK(outcome.output.find("depth") != std::string::npos);
    CHECK(files() == before);
}

TEST_CASE("a run replaces neither its own recipe nor files that no run has written") {
    const Folder folder;
    const std::string recipe = read_bytes(SIDEWALL_SOURCE_DIR "/configs/quick/trench_deposition.toml");
    std::ofstream(folder.path / "recipe.toml") << recipe;
    std::ofstream(folder.path / "surface_final.vtp") << "mine";
    const std::string command = "run recipe.toml --set flux.rays=20000 --set step[0].duration=0.1 -o .";
    const auto refused = run_program(folder.path, command, 60);
    CHECK(refused.exit_code == 2);
    CHECK(refused.output.find("choose another folder") != std::string::npos);
    CHECK(read_bytes(folder.path / "recipe.toml") == recipe);
    fs::rename(folder.path / "recipe.toml", folder.path / "trench.toml");
    CHECK(run_program(folder.path, "run trench.toml" + command.substr(command.find(" --")), 60).exit_code ==
          0);
    CHECK(read_bytes(folder.path / "surface_final.vtp") == "mine");
}

TEST_CASE("compare ends with a table of raw, Lindstrom-Turk and region, and the noise floor") {
    const Folder folder;
    const auto outcome = run_program(folder.path, "compare " + kQuickTrench + " -o out", 240);
    INFO(outcome.output);
    REQUIRE(outcome.exit_code == 0);
    for (const char* word : {"raw", "lindstrom-turk", "region", "region-bounded", "noise floor", "trace [s]",
                             "triangles", "distance max [dx]"})
        CHECK(outcome.output.find(word) != std::string::npos);
    const auto json = nlohmann::json::parse(read_bytes(folder.path / "out" / "compare.json"));
    REQUIRE(json["variants"].size() == 5);
    CHECK(json["variants"][0]["final"]["hausdorff_max"] == 0.0);
    for (std::size_t simplified = 1; simplified < 4; ++simplified)
        CHECK(json["variants"][simplified]["mesh"]["simplified"]["triangles"] <
              json["variants"][0]["mesh"]["simplified"]["triangles"]);
    CHECK(json["noise_floor"]["hausdorff_mean"] > 0.0);
}
