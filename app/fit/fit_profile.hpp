#pragma once
#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// A measured profile, whole or in part. Its points, in any order, hold the place across the wafer in the cut
/// of [metrology] and z, in the recipe's length unit.
struct MeasuredProfile {
    std::string name;  ///< FILE.csv or FILE.csv\@TIME, as the user wrote it
    std::vector<Eigen::Vector2d> points;
    std::optional<double> time;  ///< process time; absent: the run's end
    std::string understood;      ///< how the file was read, in words
};

/// Reads FILE.csv[\@TIME] as read_points() does (recipe/profile_csv.hpp), 3 to 5000 points.
/// \throws FileError naming file and line; RecipeError for a TIME that is no process time.
MeasuredProfile read_measured_profile(const std::string& name, const std::string& length_unit);

/// The bounding box of points.
Eigen::AlignedBox2d bounds_of(const std::vector<Eigen::Vector2d>& points);

/// Checks that runs of \p recipe save a surface at the profile's time.
/// \throws RecipeError saying how to set output.every.
void require_saved_time(const MeasuredProfile& profile, const Recipe& recipe);

/// Checks by the span of the points that their unit is right.
/// \throws FileError if they span more than the wafer and its copies, or less than a grid spacing.
void require_wafer_size(const MeasuredProfile& profile, const Recipe& recipe);

/// A run's profile: line segments.
using Contour = std::vector<std::array<Eigen::Vector2d, 2>>;

/// The profile of the surface that a run saved at \p time, or of its last one, in the cut of [metrology],
/// with a mirrored or periodic copy beyond each side. Empty if the run ended before \p time.
/// \throws FileError for a folder without surfaces.
Contour contour_of(const std::filesystem::path& folder, const Recipe& recipe, std::optional<double> time);

/// Directions in which a measured profile may be shifted, as its origin is not known.
struct ProfileOffset {
    bool x = false, z = false;
};

/// Distances of a measured profile from a contour.
struct ProfileDistance {
    Eigen::VectorXd signed_distances;  ///< of its points; the sign tells the side of the contour
    Eigen::Vector2d offset = Eigen::Vector2d::Zero();  ///< added to the points; minimises the sum of squares
};

/// Distances of points from a contour, after the least-squares offset in the \p free directions.
/// \returns nothing if there is no contour. O(points x segments).
std::optional<ProfileDistance> distance_to(const Contour& contour, const std::vector<Eigen::Vector2d>& points,
                                           ProfileOffset free);

}  // namespace sidewall::app
