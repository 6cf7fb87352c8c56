#pragma once
#include <cstddef>
#include <filesystem>
#include <string>

namespace sidewall::app {

/// No page is larger; what does not fit in is coarsened or left out, and the page says so.
inline constexpr std::size_t kMostPageBytes = 6'000'000;

/// A page and what it tells.
struct Report {
    std::string kind;          ///< "run", "sweep", "fit", "comparison" or "study"
    std::string html;          ///< one file that needs no other
    std::size_t surfaces = 0;  ///< in its 3-D view
};

/// Puts all that a folder of `run`, `sweep`, `fit`, `compare` or `study` holds on one page: a 3-D view, charts, tables
/// and the recipe. Unfinished ones are told as far as they went.
/// \throws FileError naming what is missing or damaged.
Report make_report(const std::filesystem::path& folder);

}  // namespace sidewall::app
