#pragma once
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"
#include "app/results/result.hpp"

namespace sidewall::app {

/// Largest page, in bytes. What does not fit is coarsened or left out, and the page says so.
inline constexpr std::size_t kMostPageBytes = 6'000'000;

/// A page of results.
struct Report {
    std::string kind;  ///< "run", "runs", "recipe", "sweep", "fit", "comparison", "study" or "validation"
    std::string html;  ///< the whole page, which needs no other file
    std::string data;  ///< JSON that the page's scripts draw
    std::size_t surfaces = 0;  ///< number in the 3-D view
};

/// Makes a page of a folder that `run`, `sweep`, `fit`, `compare`, `study` or `validate` wrote, finished or
/// not: 3-D view, charts, tables and recipe.
/// \param only   the only surface of a run that the view shows; none: all saved ones.
/// \param later  instead of \p only show the checkpoint's wafer, if that is later than all saved surfaces.
/// \throws FileError naming what is missing or damaged.
Report make_report(const std::filesystem::path& folder, const std::optional<SavedSurface>& only = {},
                   bool later = false);

/// Makes a page of several runs side by side.
/// \pre \p runs is not empty.
Report make_report(const std::vector<std::filesystem::path>& runs);

/// Makes a page of the wafer that a recipe begins with.
Report make_report(const Recipe& recipe);

}  // namespace sidewall::app
