#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "app/commands/cli_options.hpp"
#include "app/results/result.hpp"

// The choice of a wafer among those in a run's folder.
namespace sidewall::app {

/// The wafer that --step and --time name; neither: the one as it is at the end, or as far as an unfinished run has come.
struct WaferChoice {
    std::string step;
    std::optional<double> time;

    bool named() const { return time || !step.empty(); }
};

/// The options --step and --time, which exclude each other.
std::pair<CLI::Option*, CLI::Option*> add_choice_options(CLI::App& command, WaferChoice& choice);

/// The surface that a choice names among those that a folder's run has saved.
/// \throws RecipeError naming the choices; FileError if the folder has none.
SavedSurface saved_choice(const std::filesystem::path& folder, const WaferChoice& choice);

/// Reads a mesh file, or the wafer of a choice from a run's folder. That of an unfinished run is its checkpoint's, unless a
/// surface was saved since.
/// \throws as read_result and saved_choice; RecipeError if a choice is named of a mesh file.
Result read_choice(const std::filesystem::path& input, const WaferChoice& choice);

/// What to say of a folder whose run has not ended; empty of one that has, and of a file.
std::string unfinished_note(const std::filesystem::path& input);

}  // namespace sidewall::app
