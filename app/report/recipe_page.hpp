#pragma once
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "app/recipe/recipe.hpp"
#include "app/report/parts.hpp"

// Pages of recipes, and of runs beside each other.
namespace sidewall::app {

/// The wafer that a recipe begins with, in the 3-D view: on a coarser grid where its own has more cells than a picture shows.
/// \throws as initial_state.
Page recipe_page(const Recipe& recipe, std::size_t bytes);

/// Runs beside each other: the last surface of each, their profiles over each other, and runs_table.
Page runs_page(const std::vector<std::filesystem::path>& folders, std::size_t bytes);

/// What a table says of a run.
struct RunRow {
    std::string name;
    std::map<std::string, std::string> keys = {};  ///< of its recipe, as written_keys has them
    std::map<std::string, std::pair<Json, std::string>> figures =
        {};  ///< as far as it has come, with their units
};

/// A run's row; what is damaged or of another program leaves it empty.
/// \param recipe    the text of its effective recipe.
/// \param summary   that of its summary.json; empty: it has none.
/// \param timeline  its table, which serves then; may be missing.
RunRow run_row(const std::string& name, const std::string& recipe, const std::string& summary,
               const std::filesystem::path& timeline);

/// A section with a row a run: the keys in which their recipes differ, and their figures; the first 12 and 60 by name.
Json runs_table(const std::vector<RunRow>& rows);

/// The keys of an effective recipe by their paths, such as `step[0].duration`, with their values as written.
std::map<std::string, std::string> written_keys(const std::string& effective);

}  // namespace sidewall::app
