#pragma once
#include <filesystem>

#include "app/recipe/recipe.hpp"
#include "levelset/shapes/polygon.hpp"

namespace sidewall::app {

/// Points (x, z) of a profile, and a sentence on how its file was read.
struct ProfileTable {
    levelset::Polygon points;
    std::string understood;
    bool several = false;  ///< points of several lines, by the column `polyline` of a run's profiles
};

/// Reads one point a row (common/text.hpp), from the columns headed x (or y, r) and z, else from the first
/// two. Columns with a unit in the heading are converted.
/// \throws FileError naming file and line; also for over \p most points and for huge coordinates.
ProfileTable read_points(const std::filesystem::path& path, const std::string& length_unit,
                         std::size_t most = 1'000'000);

/// Reads the curve or outline of a profile layer, without repeated points.
/// \throws FileError as read_points(), and for less than two different points or several lines.
ProfileTable read_profile(const std::filesystem::path& path, const std::string& length_unit);

/// Checks that the points describe a body in the domain: no crossings, x >= 0 in a revolution, a closed
/// outline at least two cells wide and high.
/// \param first  whether the layer is the first one.
/// \throws KeyError naming the key to change.
void check_profile(const Layer& layer, const levelset::Polygon& points, bool first,
                   const levelset::Domain& domain);

}  // namespace sidewall::app
