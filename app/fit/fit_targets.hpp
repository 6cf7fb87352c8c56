#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "app/fit/fit.hpp"
#include "app/fit/fit_profile.hpp"
#include "app/sweep/run_set.hpp"
#include "surface/error.hpp"

namespace sidewall::app {

/// A target: a figure of a run's metrology and its asked value.
struct MeasureTarget {
    std::string name;
    double asked = 0.0;
    std::optional<double> sigma;
};

/// The scale of a measure's residual: its standard deviation, else |asked|, or 1 if that is 0.
double scale_of(const MeasureTarget& target);

/// All targets of a recipe.
struct FitTargets {
    std::vector<MeasureTarget> measures;
    std::vector<MeasuredProfile> profiles;
    std::optional<double> profile_sigma;
    ProfileOffset offset;
    bool known_errors = false;  ///< all have a standard deviation; else none has
};

/// Reads the targets, and checks that runs of \p recipe measure them.
/// \throws RecipeError, FileError naming the option or file.
FitTargets read_targets(const FitOptions& options, const Recipe& recipe);

/// The scale of the residuals of a profile's points: their standard deviation, else the profile's extent.
double profile_scale(const FitTargets& targets, std::size_t profile);

/// Makes a recipe measure all targets.
void want_targets(const FitTargets& targets, Recipe& recipe);

/// The contour of a run, and the distances of a measured profile from it.
struct ProfileResidual {
    Contour contour;
    ProfileDistance distance;
};

/// Compares measured profile number \p profile with a finished run; nothing if the run has no contour.
std::optional<ProfileResidual> profile_residual(const FitTargets& targets, std::size_t profile,
                                                const Recipe& recipe, const std::filesystem::path& folder);

/// Residuals of a finished run over their scales: got - asked of all measures, distances of profile points.
/// \param missing  gets the name of a target that the run does not have.
/// \returns nothing if there is such a target.
std::optional<Eigen::VectorXd> residuals_of(const FitTargets& targets, const Recipe& recipe,
                                            const SetRun& run, const std::filesystem::path& folder,
                                            std::string& missing);

/// The LABELs of the recipes: their files' names without folder and .toml; a single recipe has an empty one.
/// \throws RecipeError if two are equal.
std::vector<std::string> labels_of(const std::vector<std::string>& files);

/// The \p texts that concern a recipe: those with its label in front, which is removed, or without a label.
std::vector<std::string> own_texts(const std::vector<std::string>& texts,
                                   const std::vector<std::string>& labels, const std::string& label);

/// Checks that every text begins with a label, if there are several recipes.
/// \throws RecipeError naming the nearest label.
void require_labels(const char* option, const std::vector<std::string>& texts,
                    const std::vector<std::string>& labels);

}  // namespace sidewall::app
