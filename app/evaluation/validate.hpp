#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "app/common/json_fwd.hpp"

namespace sidewall::app {

/// A figure of a validation run that is known from elsewhere.
struct ValidationReading {
    enum class Kind {
        measure,  ///< `name` in the summary's metrology, at the run's end
        floor,    ///< mean of attribute `name` over the triangles that face up, at the run's start
        wall,     ///< of those that face sideways
        all,      ///< of all
        share     ///< its sum over the substrate's area, by `opening`
    };
    std::string label = {};  ///< what it is
    std::string unit = "1";  ///< 1 for a number
    Kind kind = Kind::measure;
    std::string name = {};
    double reference = 0.0;
    double reference_bar = 0.0;           ///< how exact the reference is
    double z_low = -1e30, z_high = 1e30;  ///< of the triangles' centroids
    double radius = 1e30;                 ///< and how far at most they lie from the axis
    double opening = 0.0;                 ///< area
    bool length = false;                  ///< a distance: no better known than a part of the grid spacing
};

/// A run whose figures are known: a recipe, and where the truth comes from.
struct ValidationCase {
    std::string name;    ///< a word
    std::string title;   ///< what is checked
    std::string source;  ///< of the reference
    std::string note;    ///< what a reader should know besides; may be empty
    std::string recipe;  ///< TOML
    bool traced = true;  ///< fluxes are, so that another seed tells the noise
    std::vector<ValidationReading> readings;
};

/// All cases, in the order of the report.
const std::vector<ValidationCase>& validation_cases();

struct ValidationOptions {
    std::filesystem::path output;
    std::vector<std::string> cases;  ///< names; empty: all
    bool overwrite = false;          ///< as in RunOptions
    bool resume = false;         ///< runs of the same recipes and version that are there are not made again
    std::string resume_command;  ///< as in RunOptions
    std::function<void(const Json&)> finished{};  ///< told each case as it ends
};

/// Runs the cases. Each is run on its grid, with another seed if it traces, and on twice the spacing: the bar of a figure is the
/// sum of both differences, which for a scheme of first order estimates grid and noise; of lengths at least a tenth of the grid
/// spacing.
///
/// Writes DIR/{validation.json, validation.md} and the runs into DIR/NAME, NAME-seed and NAME-coarse. Cases that are
/// not run keep the rows that the report has of them, if their recipes are still the same.
/// \returns what validation.json holds.
/// \throws RecipeError for an unknown case; FileError for a validation.json that is none; what run_recipe throws.
Json validate(const ValidationOptions& options);

/// The page in Markdown.
std::string validation_page(const Json& validation);

}  // namespace sidewall::app
