#pragma once
#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// A measured profile: points of all of it or a part, in any order: across the wafer along the cut of
/// [metrology], and z; in the recipe's length unit.
struct MeasuredProfile {
    std::string name;  ///< FILE.csv or FILE.csv\@TIME, as the user wrote it
    std::vector<Eigen::Vector2d> points;
    std::optional<double> time;  ///< process time; absent: the run's end
    std::string understood;      ///< how the file was read, in words
};

/// Reads FILE.csv[\@TIME] as read_points() does (recipe/profile_csv.hpp), 3 to 5000 points.
/// \throws FileError naming file and line; RecipeError for a time that is none.
MeasuredProfile read_measured_profile(const std::string& name, const std::string& length_unit);

/// The box around points of a profile.
Eigen::AlignedBox2d bounds_of(const std::vector<Eigen::Vector2d>& points);

/// Checks that runs of \p recipe save a surface at the profile's time.
/// \throws RecipeError naming the times they do.
void require_saved_time(const MeasuredProfile& profile, const Recipe& recipe);

/// Checks the unit of the points by their span.
/// \throws FileError if that is more than the wafer and its copies beyond the sides, or less than a grid spacing.
void require_wafer_size(const MeasuredProfile& profile, const Recipe& recipe);

/// A run's profile: line segments.
using Contour = std::vector<std::array<Eigen::Vector2d, 2>>;

/// The surface that a run saved at \p time (its last one: absent), where the cut of [metrology] meets it, and beyond the
/// sides once more as they mirror or repeat it.
/// \throws FileError for a folder without surfaces.
Contour contour_of(const std::filesystem::path& folder, const Recipe& recipe, std::optional<double> time);

/// Directions in which a measured profile may be shifted: its origin is not known.
struct ProfileOffset {
    bool x = false, z = false;
};

/// Distances of a measured profile from a contour.
struct ProfileDistance {
    Eigen::VectorXd signed_distances;  ///< of its points, opposite on the contour's two sides
    Eigen::Vector2d offset =
        Eigen::Vector2d::Zero();  ///< that was added to the points; of the least sum of squares
};

/// Distances after the offset, in the free directions, of the least sum of squares.
/// \returns nothing if there is no contour. O(points x pieces).
std::optional<ProfileDistance> distance_to(const Contour& contour, const std::vector<Eigen::Vector2d>& points,
                                           ProfileOffset free);

}  // namespace sidewall::app
