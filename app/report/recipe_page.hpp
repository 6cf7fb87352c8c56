#pragma once
#include <map>
#include <string>

#include "app/recipe/recipe.hpp"
#include "app/report/parts.hpp"

// Pages of recipes, and of runs beside each other.
namespace sidewall::app {

/// The wafer that a recipe begins with, in the 3-D view: on a coarser grid where its own has more cells than a picture shows.
/// \throws as initial_state.
Page recipe_page(const Recipe& recipe, std::size_t bytes);

/// Runs beside each other: the last surface of each, their profiles over each other, and runs_table.
Page runs_page(const std::vector<std::filesystem::path>& folders, std::size_t bytes);

/// A section with a row a run: the keys in which their recipes differ, and their figures, as far as each has come.
/// \param names  of the runs, as many as folders.
Json runs_table(const std::vector<std::filesystem::path>& folders, const std::vector<std::string>& names);

/// The keys of an effective recipe by their paths, such as `step[0].duration`, with their values as written.
std::map<std::string, std::string> written_keys(const std::string& effective);

}  // namespace sidewall::app
