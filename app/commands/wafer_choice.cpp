#include "app/commands/wafer_choice.hpp"

#include <fmt/format.h>

#include "app/common/files.hpp"
#include "app/process/record/saved_wafer.hpp"
#include "surface/error.hpp"

namespace sidewall::app {

std::pair<CLI::Option*, CLI::Option*> add_choice_options(CLI::App& command, WaferChoice& choice) {
    CLI::Option& step = add_option(
        command, "--step", choice.step, "NAME",
        "Of a folder: the wafer at the end of this step, by its name or number; of a loop's the last");
    CLI::Option& time = add_option(
        command, "--time", choice.time, "T",
        "Of a folder: the saved surface nearest to this process time, in the recipe's unit (default: the last)");
    exclude(step, time);
    return {&step, &time};
}

SavedSurface saved_choice(const std::filesystem::path& folder, const WaferChoice& choice) {
    const std::vector<SavedSurface> saved = saved_surfaces(folder);
    return choice.time ? saved_at(saved, *choice.time) : saved_after(saved, choice.step);
}

Result read_choice(const std::filesystem::path& input, const WaferChoice& choice) {
    if (choice.named() && is_there(input) && !std::filesystem::is_directory(input))
        throw RecipeError(
            fmt::format("{}: {} chooses among the surfaces of a run: name the folder that `run` wrote",
                        input.string(), choice.time ? "--time" : "--step"));
    if (choice.named()) return read_saved(input, saved_choice(input, choice));
    if (!unfinished_note(input).empty())
        if (auto reached = wafer_of_checkpoint(input)) return *std::move(reached);
    return read_result(input);
}

std::string unfinished_note(const std::filesystem::path& input) {
    std::error_code failure;
    if (!std::filesystem::is_directory(input, failure) || is_there(input / "summary.json")) return {};
    return fmt::format("{}: the run has not ended: this is how far it has come", input.string());
}

}  // namespace sidewall::app
