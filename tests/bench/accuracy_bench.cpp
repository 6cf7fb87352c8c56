// Checks whether the error bars of `sidewall run --accuracy` hold. Twelve recipes with two figures each are
// run to an accuracy, and again on half the spacing that this settles on, with four times the rays, without
// simplification and with another seed.
//   accuracy_bench [FOLDER, /tmp/sidewall_accuracy] [RECIPE]...
// A figure that is reported as unknown has no bar and does not count as one that holds.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "app/accuracy/accuracy.hpp"
#include "app/recipe/effective_recipe.hpp"
#include "surface/error.hpp"

using namespace sidewall;
using namespace sidewall::app;

namespace {

struct Case {
    const char* recipe;  // name in configs/quick
    std::vector<std::string> accuracy, overrides;
};

// Noise of few rays and errors of coarse grids limit the accuracy that quick recipes reach in seconds.
const std::vector<Case> kCases = {
    {"trench_profile", {"film_bottom=6%", "mean_rate=2%"}, {}},
    {"teos_trench", {"depth=2%", "step_coverage_side=10%"}, {}},
    {"simple_hole_etch", {"removed_volume_Si=15%", "cd_at_0.2=10%"}, {}},
    {"deposit_and_etch", {"depth=5%", "cd_at_0.25=5%"}, {}},
    {"isotropic_deposition", {"film_side=3%", "added_volume_SiO2=3%"}, {}},
    {"pinch_off", {"film_bottom=20%", "added_volume_SiO2=4%"}, {}},
    {"sheath_ions", {"depth=5%", "removed_volume_Si=5%"}, {}},
    {"ion_beam_trench", {"depth=8%", "cd_at_0.1=8%"}, {}},
    {"wet_etch_pit", {"depth=10%", "removed_volume_Si=25%"}, {}},
    {"trench_deposition", {"film_bottom=10%", "depth=3%"}, {}},
    {"hole_deposition", {"film_side=12%", "depth=4%"}, {}},
    {"sputter_facet", {"depth=20%", "cd_at_0.2=10%"}, {}},
};

double seconds(const Json& summary) {
    return summary["timing"]["total"].get<double>();
}

Json run_truth(const Recipe& recipe, const Json& found, const std::filesystem::path& folder) {
    std::vector<std::string> changes{
        fmt::format("domain.grid_spacing={}", 0.5 * found["grid_spacing"].get<double>()), "flux.seed=101",
        "simplify.method=none"};
    for (const Json& run : found["accuracy_runs"])
        if (run["folder"] == "." && run.contains("rays"))
            changes.push_back(fmt::format("flux.rays={:.0f}", 4.0 * run["rays"].get<double>()));
    const Recipe fine = parse_recipe(effective_recipe(recipe), recipe.file, changes);
    return run_recipe(fine, {.output = folder, .overwrite = true, .quiet = true}).summary;
}

struct Count {
    int figures = 0, known = 0, hold = 0, reached = 0;
    std::vector<double> ratios;
};

void run_case(const Case& one, const std::filesystem::path& folder, Count& count) {
    Recipe recipe =
        load_recipe(fmt::format("{}/configs/quick/{}.toml", SIDEWALL_SOURCE_DIR, one.recipe), one.overrides);
    const std::vector<AskedAccuracy> asked = read_accuracy(one.accuracy, recipe);
    const RunOptions options{.output = folder / one.recipe, .overwrite = true, .quiet = true};
    const Json found = run_to_accuracy(recipe, one.overrides, asked, options).summary;
    const Json truth = run_truth(recipe, found, folder / (std::string(one.recipe) + "-truth"));
    const double ratio =
        found["accuracy_seconds"]["total"].get<double>() / found["accuracy_seconds"]["settled"].get<double>();
    count.ratios.push_back(ratio);
    fmt::print("{}: {} grids to {:.4g}, {:.1f} s, {:.2f} times the last run; fine run {:.1f} s\n", one.recipe,
               std::count_if(found["accuracy_runs"].begin(), found["accuracy_runs"].end(),
                             [](const Json& run) {
                                 const std::string name = run["folder"];
                                 return name == "." || name.find("grid") != std::string::npos;
                             }),
               found["grid_spacing"].get<double>(), found["accuracy_seconds"]["total"].get<double>(), ratio,
               seconds(truth));
    for (const AskedAccuracy& figure : asked) {
        const Json& bars = found["accuracy"][figure.measure];
        const Json exact = truth["metrology"].value(figure.measure, Json());
        ++count.figures;
        const bool known = bars["total"].is_number() && exact.is_number();
        const double error = known ? std::abs(bars["value"].get<double>() - exact.get<double>()) : NAN;
        const bool holds = known && error <= bars["total"].get<double>();
        count.known += known ? 1 : 0;
        count.hold += holds ? 1 : 0;
        count.reached += bars["status"] == "reached" ? 1 : 0;
        fmt::print("  {:<20} {} asked {} fine {} off by {:.2g}: {} {}\n", figure.measure, bars.dump(),
                   figure.text, exact.dump(), error,
                   !known  ? "unknown"
                   : holds ? "holds"
                           : "DOES NOT HOLD",
                   bars["status"].get<std::string>());
    }
    std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
    try {
        const std::filesystem::path folder = argc > 1 ? argv[1] : "/tmp/sidewall_accuracy";
        const std::vector<std::string> names(argv + std::min(argc, 2), argv + argc);
        Count count;
        for (const Case& one : kCases)
            if (names.empty() || std::find(names.begin(), names.end(), one.recipe) != names.end())
                run_case(one, folder, count);
        std::sort(count.ratios.begin(), count.ratios.end());
        fmt::print(
            "{} figures, {} with bars, {} of these hold, {} as asked; time over the last run's: median {:.2f}, "
            "most {:.2f}\n",
            count.figures, count.known, count.hold, count.reached, count.ratios[count.ratios.size() / 2],
            count.ratios.back());
    } catch (const std::exception& error) {
        fmt::print(stderr, "{}\n", error.what());
        return 1;
    }
}
