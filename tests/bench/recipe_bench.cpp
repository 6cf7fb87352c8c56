// CPU microseconds a surface vertex and time step by phase of whole recipes on one thread, by two builds in
// turn:
//   recipe_bench BASELINE_SIDEWALL SIDEWALL [RUNS, 3] [RECIPE | NAME KEY=VALUE...]...
// e.g. with the commit before: recipe_bench ../before/build/release/sidewall build/release/sidewall 5
// Phases are measured in wall time by the program itself and scaled by its CPU time over its wall time, both
// from its start to its end, so that other work on the machine weighs little. Results go to memory where
// Linux has it: waiting for a disk counts for no phase. "level set" is all from extraction to re-distancing;
// "rest" what the program does between its phases, "start" before the first one.
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/bench/measure.hpp"

namespace {

namespace fs = std::filesystem;
using Phases = std::map<std::string, double>;

double cpu_of_children() {
    rusage used{};
    getrusage(RUSAGE_CHILDREN, &used);
    const auto seconds = [](const timeval& t) {
        return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    return seconds(used.ru_utime) + seconds(used.ru_stime);
}

// Surface vertices summed over the time steps.
double vertices_of(const fs::path& timeline) {
    std::ifstream file(timeline);
    std::string line, cell;
    std::getline(file, line);
    std::size_t column = 0;
    for (std::istringstream header(line); std::getline(header, cell, ',') && cell != "raw_vertices";)
        ++column;
    double sum = 0.0;
    while (std::getline(file, line)) {
        std::istringstream row(line);
        for (std::size_t k = 0; k <= column; ++k) std::getline(row, cell, ',');
        sum += std::atof(cell.c_str());
    }
    return sum;
}

// Microseconds a vertex and time step, by phase.
Phases run(const std::string& program, const std::string& recipe, const fs::path& folder) {
    fs::remove_all(folder);
    const std::string name = recipe.substr(0, recipe.find(' '));
    std::string command = fmt::format("{} run {}/configs/{}.toml -o {} --threads 1 --quiet", program,
                                      SIDEWALL_SOURCE_DIR, name, folder.string());
    std::istringstream rest(recipe.substr(name.size()));
    for (std::string key; rest >> key;) command += " --set " + key;
    const double before = cpu_of_children();
    const auto start = std::chrono::steady_clock::now();
    if (std::system((command + " 2>/dev/null").c_str()) != 0) {
        fmt::print(stderr, "fails: {}\n", command);
        std::exit(1);
    }
    const double cpu = cpu_of_children() - before,
                 wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    nlohmann::json timing = nlohmann::json::parse(std::ifstream(folder / "summary.json")).at("timing");
    const double total = timing.at("total").get<double>(),
                 scale = 1e6 * cpu / wall / vertices_of(folder / "timeline.csv");
    timing.erase("total");
    Phases phases;
    double known = 0.0;
    for (const auto& [phase, seconds] : timing.items()) {
        known += seconds.get<double>();
        phases[phase] = scale * seconds.get<double>();
    }
    phases["rest"] = scale * (total - known);
    phases["start"] = scale * (wall - total);
    for (const char* phase : {"extract", "bvh", "rates", "extend", "advect", "redistance"})
        phases["level set"] += phases[phase];
    phases["all, CPU s"] = cpu;
    return phases;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc < 3) {
        fmt::print(stderr,
                   "usage: recipe_bench BASELINE_SIDEWALL SIDEWALL [RUNS] [\"RECIPE KEY=VALUE...\"]...\n");
        return 2;
    }
    const int runs = argc > 3 ? std::atoi(argv[3]) : 3;
    std::vector<std::string> recipes(argv + std::min(argc, 4), argv + argc);
    if (recipes.empty())
        recipes = {"directional_hole_etch domain.grid_spacing=0.025", "wet_etch_pit", "isotropic_deposition",
                   "fin_sequence"};
    const fs::path memory = "/dev/shm";
    const fs::path folder = (fs::is_directory(memory) ? memory : fs::temp_directory_path()) /
                            fmt::format("recipe_bench_{}", getpid());
    for (const std::string& recipe : recipes) {
        std::map<std::string, std::vector<double>> values[2];
        for (int n = 0; n < runs; ++n)
            for (const int side : {0, 1})
                for (const auto& [phase, value] : run(argv[1 + side], recipe, folder))
                    values[side][phase].push_back(value);
        fmt::print("{}: CPU us a vertex and time step, median of {}\n{:<12}{:>10}{:>10}{:>10}\n", recipe,
                   runs, "", "baseline", "now", "ratio");
        for (const auto& [phase, list] : values[0]) {
            const double before = sidewall::bench::median(list),
                         after = sidewall::bench::median(values[1][phase]);
            if (before > 0.0)
                fmt::print("{:<12}{:>10.3f}{:>10.3f}{:>10.2f}\n", phase, before, after, before / after);
        }
    }
    fs::remove_all(folder);
}
