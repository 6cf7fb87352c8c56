#pragma once
#include <filesystem>

#include "app/recipe/recipe.hpp"
#include "levelset/shapes/polygon.hpp"

namespace sidewall::app {

/// Points of a profile, x and z, and how its file was read, in words.
struct ProfileTable {
    levelset::Polygon points;
    std::string understood;
    bool several = false;  ///< they are of more than one line, by the column `polyline` of a run's profiles
};

/// Reads a point a row (common/text.hpp): of columns with headings those named x (or y, r) and z, else the first two. What
/// has its unit in the heading is converted.
/// \throws FileError naming file and line; also for over \p most points and for coordinates that are huge.
ProfileTable read_points(const std::filesystem::path& path, const std::string& length_unit,
                         std::size_t most = 1'000'000);

/// Reads the curve or outline of a profile layer; repeated points are left out.
/// \throws FileError as read_points(), and for less than two different points or several lines.
ProfileTable read_profile(const std::filesystem::path& path, const std::string& length_unit);

/// Checks that the points make a body in the domain: without crossings, on the right side of an axis of revolution, two
/// cells wide and high if it is closed.
/// \param first  nothing lies below the layer.
/// \throws KeyError naming the key that is to be changed.
void check_profile(const Layer& layer, const levelset::Polygon& points, bool first,
                   const levelset::Domain& domain);

}  // namespace sidewall::app
