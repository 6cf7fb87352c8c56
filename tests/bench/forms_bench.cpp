// CPU time of a process in another form over that of its first form, by the same program in turns:
//   forms_bench [RUNS, 5]
// - a built-in model restated as a formula: should be at most 1.3
// - a profile in x and z against a strip ten cells wide, with as many rays a cell (should be at most a fifth)
//   and with as many rays in all
// Ratios are medians over the runs.
#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "app/process/simulation.hpp"
#include "tests/bench/measure.hpp"
#include "tests/restated.hpp"

using namespace sidewall;
using namespace sidewall::app;

namespace {

struct Form {
    std::string text;
    std::vector<std::string> overrides;
};

double seconds(const Form& form, const std::filesystem::path& folder) {
    const Recipe recipe = parse_recipe(form.text, "recipe.toml", form.overrides);
    return bench::cpu_seconds_of(
        [&] { run_recipe(recipe, {.output = folder, .overwrite = true, .quiet = true}); });
}

void compare(const char* what, const Form& one, const Form& other, int runs,
             const std::filesystem::path& folder) {
    std::vector<double> ones, others, ratios;
    for (int k = 0; k < runs; ++k) {
        ones.push_back(seconds(one, folder));
        others.push_back(seconds(other, folder));
        ratios.push_back(ones.back() / others.back());
    }
    fmt::print("{:<52} {:7.3f} s {:7.3f} s  ratio {:.3f}\n", what, bench::median(ones), bench::median(others),
               bench::median(ratios));
    std::fflush(stdout);
}

std::string quick(const std::string& name) {
    return surface::read_whole_file(SIDEWALL_SOURCE_DIR "/configs/quick/" + name);
}

}  // namespace

int main(int argc, char** argv) {
    try {
        const int runs = argc > 1 ? std::atoi(argv[1]) : 5;
        if (runs < 1) throw std::runtime_error("usage: forms_bench [RUNS]");
        const std::filesystem::path folder =
            std::filesystem::temp_directory_path() / fmt::format("forms_bench_{}", getpid());
        for (const auto& [name, step] : {std::pair("sf6o2_hole", test::kSf6), {"teos_trench", test::kTeos}}) {
            const std::string file = std::string(name) + ".toml";
            compare(fmt::format("{}: formula, built-in", name).c_str(), {test::restated(file, step), {}},
                    {quick(file), {}}, runs, folder);
        }
        const std::vector<std::string> ten{"domain.extent=[10.0, 2.5]",
                                           "domain.boundary=[\"reflective\", \"periodic\"]"};
        for (const char* rays : {"200000", "20000"}) {
            std::vector<std::string> wide = ten;
            wide.push_back(std::string("flux.rays=") + rays);
            compare(fmt::format("trench_profile: 20000 rays, ten cells with {}", rays).c_str(),
                    {quick("trench_profile.toml"), {}}, {quick("trench_profile.toml"), wide}, runs, folder);
        }
        std::filesystem::remove_all(folder);
    } catch (const std::exception& error) {
        fmt::print(stderr, "{}\n", error.what());
        return 1;
    }
}
