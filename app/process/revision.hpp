#pragma once
#include <filesystem>

#include "app/process/state.hpp"
#include "app/recipe/recipe.hpp"

// When a run may go on with another recipe than the one that began it.
namespace sidewall::app {

/// Checks that a run may continue with \p recipe from its next time step on. It may trace, simplify and
/// advect in other ways, and have other values in the current step and other steps after it.
/// \throws RecipeError naming any other difference.
void require_revision(const Recipe& recipe, const Recipe& began_with, const RunState& state);

/// Whether two versions of a step have the same stop conditions; over-etch and duration may differ.
bool same_stop_conditions(const Step& a, const Step& b);

/// Prepares a resumed run to continue with \p recipe. Everything but the steps, and the completed steps, must
/// agree. The current step, or the last one of a finished run, may have a longer duration or over-etch, or a
/// stop condition that is met later; names of steps may differ.
/// \throws FileError naming the differences that forbid it.
void extend(RunState& state, const Recipe& recipe, const Recipe& began_with);

/// Rethrows the current exception, by which the extension of a finished run failed, with a line on how to get
/// that run back. Returns if it is none of this program's errors.
/// \param before  when the finished run wrote its checkpoint.
void rethrow_with_undo_advice(const std::filesystem::path& folder, std::filesystem::file_time_type before);

}  // namespace sidewall::app
