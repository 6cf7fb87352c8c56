#pragma once
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "app/recipe/recipe.hpp"
#include "app/report/parts.hpp"

// Pages of recipes, and of several runs side by side.
namespace sidewall::app {

/// A page with the initial wafer of a recipe in the 3-D view, on a grid no finer than a picture needs.
/// \throws as initial_state.
Page recipe_page(const Recipe& recipe, std::size_t bytes);

/// A page of several runs: the last surface of each, their profiles in one chart, and runs_table.
Page runs_page(const std::vector<std::filesystem::path>& folders, std::size_t bytes);

/// A run in the table of runs.
struct RunRow {
    std::string name;
    std::map<std::string, std::string> keys = {};  ///< written_keys of its recipe
    std::map<std::string, std::pair<Json, std::string>> figures =
        {};  ///< last values with their units, by name
};

/// A run's row; empty if its files are damaged or not by this program.
/// \param recipe    text of its effective recipe.
/// \param summary   text of its summary.json; empty: it has none.
/// \param timeline  its timeline.csv, read if \p summary is empty; may be missing.
RunRow run_row(const std::string& name, const std::string& recipe, const std::string& summary,
               const std::filesystem::path& timeline);

/// A table with a row a run: keys in which the recipes differ (first 12 by name) and figures (first 60).
Json runs_table(const std::vector<RunRow>& rows);

/// The keys of an effective recipe by path, such as `step[0].duration`, with their values as text.
std::map<std::string, std::string> written_keys(const std::string& effective);

}  // namespace sidewall::app
