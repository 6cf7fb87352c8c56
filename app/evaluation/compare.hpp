#pragma once
#include <filesystem>
#include <string>

#include "app/common/json_fwd.hpp"
#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// Runs the recipe raw, with every method of simplification but CGAL's, and raw with another seed, in folders
/// under \p output. Distances of final surfaces are two-sided, from that of the raw run, in grid spacings.
/// \param overwrite  as in RunOptions.
/// \returns what compare.json holds: `variants[]` and `noise_floor`.
Json compare_methods(const Recipe& recipe, const std::filesystem::path& output, bool quiet,
                     bool overwrite = false);

/// The comparison as a text table, which ends with compare_verdict().
std::string compare_table(const Json& comparison);

/// A sentence saying whether simplification paid: the time for the flux at the raw run's statistical error,
/// raw and by the fastest method, why they differ, and the times of whole runs with equal rays. Times within
/// 5 % count as equal.
/// \throws what a JSON that is no comparison throws.
std::string compare_verdict(const Json& comparison);

}  // namespace sidewall::app
