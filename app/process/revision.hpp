#pragma once
#include <filesystem>

#include "app/process/state.hpp"
#include "app/recipe/recipe.hpp"

// When a run may go on with another recipe than the one that began it.
namespace sidewall::app {

/// Lets a run go on with \p recipe before its next time step: it may trace, simplify and advect in other ways, and
/// have other values of the step at hand and other steps after it.
/// \throws RecipeError naming what else differs.
void require_revision(const Recipe& recipe, const Recipe& began_with, const RunState& state);

/// Whether two forms of a step have the same stop conditions; over-etch and duration aside.
bool stops_alike(const Step& a, const Step& b);

/// Lets a resumed run go on with \p recipe where the two agree: in all but their steps, and in the steps that are
/// done. The step at hand, or the last one of a finished run, may last longer or have a later stop_depth or
/// stop_thickness; names of steps may differ.
/// \throws FileError naming the differences that forbid it.
void extend(RunState& state, const Recipe& recipe, const Recipe& began_with);

/// Throws the error at hand again, with a line on how to get the finished run back whose extension failed by it. Returns if
/// it is none of this program's errors.
/// \param before  when the finished run's checkpoint was written.
void rethrow_with_way_back(const std::filesystem::path& folder, std::filesystem::file_time_type before);

}  // namespace sidewall::app
