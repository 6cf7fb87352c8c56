#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <memory>

#include "app/commands/cli_options.hpp"
#include "app/common/processes.hpp"
#include "app/process/estimate/blanket.hpp"
#include "app/process/estimate/estimate.hpp"
#include "app/process/estimate/memory.hpp"
#include "app/recipe/effective_recipe.hpp"
#include "app/recipe/layers.hpp"
#include "app/recipe/notes.hpp"
#include "app/recipe/recipe.hpp"
#include "app/recipe/recipe_domain.hpp"
#include "app/recipe/step_materials.hpp"

namespace sidewall::app {
namespace {

std::string duration_text(double seconds) {
    if (seconds < 1.0) return "under 1 s";
    if (seconds < 100.0) return fmt::format("{:.2g} s", seconds);
    if (seconds < 100.0 * 60.0) return fmt::format("{:.2g} min", seconds / 60.0);
    if (seconds < 100.0 * 3600.0) return fmt::format("{:.2g} h", seconds / 3600.0);
    return fmt::format("{:.3g} days", seconds / 86400.0);
}

// A count to two digits, without an exponent below a million.
std::string count_text(double count) {
    if (count < 100.0) return fmt::format("{:.0f}", count);
    if (count >= 1e6) return fmt::format("{:.1e}", count);
    const double unit = count < 1e3 ? 10.0 : count < 1e4 ? 100.0 : count < 1e5 ? 1e3 : 1e4;
    return fmt::format("{:.0f}", unit * std::round(count / unit));
}

std::string memory_text(double bytes) {
    return bytes < 1e9 ? fmt::format("{:.0f} MB", bytes / 1e6) : fmt::format("{:.2g} GB", bytes / 1e9);
}

std::string coarser_text(const Recipe& recipe, const levelset::Domain& domain) {
    std::string text;
    const int levels = grid_levels(recipe, domain);
    for (int n = 1; n < levels; ++n)
        text += fmt::format("{}{:.6g}", n == 1 ? ", where these need not be " : " or ",
                            domain.spacing * (1 << n));
    return text;
}

void print_estimate(const Recipe& recipe) {
    const Estimate estimate = estimate_run(recipe);
    if (!estimate.known) {
        const levelset::Domain domain = domain_of(recipe);
        fmt::print(
            "#\n# A run takes {} of memory. Its wafer, {} layers on {} x {} cells, takes about {} to build with {} "
            "threads;\n# this was not tried, and time steps, rays and wall time are not estimated.\n",
            memory_text(estimate.memory), layer_count(recipe), domain.cells[0], domain.cells[1],
            duration_text(estimate.building), thread_count());
        return;
    }
    const bool reuse = recipe.flux.reuse > 0.0 && estimate.rays > 0.0;
    const std::string most = reuse ? "at most " : "";
    fmt::print("#\n# A run on this machine with {} threads takes, usually within a factor of two:\n",
               thread_count());
    fmt::print("#   time steps {}\n", count_text(estimate.time_steps));
    fmt::print("#   rays       {}{}{}\n", most, count_text(estimate.rays),
               estimate.flux_error > 0.0 && std::isfinite(estimate.flux_error)
                   ? fmt::format(", relative flux error {:.1g}", estimate.flux_error)
                   : "");
    for (const std::string& methods : estimate.methods) fmt::print("#   fluxes     {}\n", methods);
    for (const std::string& note : estimate.short_of) fmt::print("#   fluxes     {}\n", note);
    fmt::print("#   memory     {}\n", memory_text(estimate.memory));
    fmt::print("#   wall time  {}{}, between {} and {}\n", most, duration_text(estimate.seconds),
               duration_text(estimate.least_seconds), duration_text(estimate.most_seconds));
    if (estimate.narrowest > 0.0)
        fmt::print(
            "#   openings   the narrowest in the cut {} is {:.4g} {} wide, {:.3g} cells; aspect ratio {:.3g}\n",
            recipe.metrology.cut, estimate.narrowest, recipe.domain.length_unit,
            estimate.narrowest / domain_of(recipe).spacing, estimate.aspect_ratio);
}

}  // namespace

void add_check_command(CLI::App& program) {
    CLI::App& command = *program.add_subcommand(
        "check",
        "Parse and validate a recipe, print it with every default, the blanket rates of its steps, and an estimate of what a "
        "run takes; write nothing");
    const auto options = add_recipe_options(command);
    const auto quick = std::make_shared<bool>(false);
    command.add_flag(
        "--no-estimate", *quick,
        "Skip the first time steps (a second or two) that estimate time steps, rays, memory and wall time, and the check of "
        "this machine's memory");
    command.callback([options, quick] {
        const Recipe recipe = recipe_of(*options);
        print_notes(recipe, recipe.file);
        const levelset::Domain domain = domain_of(recipe);
        fmt::print("{}# The grid: {} x {} cells of {:.10g} {}{}.\n{}{}", effective_recipe(recipe),
                   domain.cells[0], domain.cells[1], domain.spacing, recipe.domain.length_unit,
                   coarser_text(recipe, domain), values_by_material(recipe), blanket_table(recipe));
        if (const std::string note = cheaper_form(recipe); !note.empty()) fmt::print("# {}\n", note);
        if (*quick) return;
        std::fflush(stdout);
        require_memory(recipe, domain);
        print_estimate(recipe);
    });
}

}  // namespace sidewall::app
