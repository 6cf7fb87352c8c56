#pragma once
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include "app/results/result.hpp"

namespace sidewall::app {

/// Largest page. What does not fit is coarsened or left out, and the page says so.
inline constexpr std::size_t kMostPageBytes = 6'000'000;

/// A page of results.
struct Report {
    std::string kind;          ///< "run", "sweep", "fit", "comparison", "study" or "validation"
    std::string html;          ///< one file that needs no other
    std::size_t surfaces = 0;  ///< in its 3-D view
};

/// Makes a page of all that a folder of `run`, `sweep`, `fit`, `compare`, `study` or `validate` holds, finished or not: a 3-D
/// view, charts, tables and the recipe.
/// \param only  of a run's surfaces, to be the only one in the view; none: all of them.
/// \throws FileError naming what is missing or damaged.
Report make_report(const std::filesystem::path& folder, const std::optional<SavedSurface>& only = {});

}  // namespace sidewall::app
