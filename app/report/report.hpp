#pragma once
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"
#include "app/results/result.hpp"

namespace sidewall::app {

/// Largest page. What does not fit is coarsened or left out, and the page says so.
inline constexpr std::size_t kMostPageBytes = 6'000'000;

/// A page of results.
struct Report {
    std::string kind;  ///< "run", "runs", "recipe", "sweep", "fit", "comparison", "study" or "validation"
    std::string html;  ///< one file that needs no other
    std::string data;  ///< that the page's scripts draw, as JSON
    std::size_t surfaces = 0;  ///< in its 3-D view
};

/// Makes a page of all that a folder of `run`, `sweep`, `fit`, `compare`, `study` or `validate` holds, finished or not: a 3-D
/// view, charts, tables and the recipe.
/// \param only   of a run's surfaces, to be the only one in the view; none: all of them.
/// \param later  instead of it the checkpoint's wafer, if that is later than all of them.
/// \throws FileError naming what is missing or damaged.
Report make_report(const std::filesystem::path& folder, const std::optional<SavedSurface>& only = {},
                   bool later = false);

/// Makes a page of several runs beside each other.
/// \pre there is one.
Report make_report(const std::vector<std::filesystem::path>& runs);

/// Makes a page of the wafer that a recipe begins with.
Report make_report(const Recipe& recipe);

}  // namespace sidewall::app
