#pragma once
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"

// Cases of `validate`: folders with recipe.toml and reference.csv, whose columns are in docs/validation.md.
namespace sidewall::app {

/// A figure of a run and what it should be: a row of reference.csv.
struct ReferenceFigure {
    std::string
        figure;  ///< a measure, flux_SPECIES or coverage_NAME at the run's start, or a profile FILE.csv
    std::string label, unit;            ///< for the report; a pure number has the unit 1
    double reference = 0.0, bar = 0.0;  ///< the right value and its uncertainty
    std::string role;  ///< "fitted": a parameter was chosen to meet it; "held out": of the same data, but
                       ///< not used for that; "same number": the recipe was given this value
    std::string why;   ///< a sentence: why the run's figure lies outside of the bars, if it does
    std::vector<std::string>
        settings{};  ///< KEY=VALUE: changes of the recipe for this row; rows with equal settings share a run
    double x = std::numeric_limits<double>::quiet_NaN();  ///< its place on the x axis of the case's chart
    double per = 1.0;                                     ///< what the run's figure is divided by
    std::string where;  ///< part of the surface that counts for a flux: floor, wall, a material; empty: all
    double z_from = -1e30, z_to = 1e30;  ///< heights of the triangles' centroids that count for a flux
    double radius = 1e30;                ///< their largest distance from the axis
    double opening = 0.0;  ///< area that the sum of a flux is divided by; 0: its area, which gives the mean
    std::string place;     ///< FILE:LINE, for messages

    bool is_of_surface() const { return figure.starts_with("flux_") || figure.starts_with("coverage_"); }
    bool is_profile() const { return figure.find(".csv") != std::string::npos; }
};

/// A case: a recipe, reference values of figures of its runs, and their source.
struct ValidationCase {
    std::filesystem::path folder;
    std::string name;           ///< of the folder
    std::string title;          ///< what is checked
    std::string source;         ///< of the reference values
    std::string note;           ///< further remarks for the reader; may be empty
    std::string fitted;         ///< which parameters were fitted to which rows; empty: none
    std::string x_axis;         ///< label of the x axis
    double order = 1e30;        ///< cases are sorted by it in the report
    std::string recipe, table;  ///< content of its two files
    std::vector<ReferenceFigure> figures;
};

/// The folder of cases that came with the program: share/sidewall/configs/validation or configs/validation in
/// one of the folders above the program's own.
/// \throws FileError if there is none.
std::filesystem::path shipped_cases();

/// All cases of a folder, by order and name.
/// \throws FileError naming file and line of what is missing or wrong.
std::vector<ValidationCase> validation_cases(const std::filesystem::path& folder);

/// The rows of a case, by number, grouped by settings: rows with equal settings share a run.
std::vector<std::vector<std::size_t>> case_runs(const ValidationCase& one);

/// The recipe of a case with the settings of \p rows, whose figures it measures, and then \p changes.
/// \param rows  by number; with equal settings.
/// \throws RecipeError, FileError naming file and line, if the recipe is wrong or a figure unknown to it.
Recipe case_recipe(const ValidationCase& one, const std::vector<std::size_t>& rows,
                   const std::vector<std::string>& changes = {});

}  // namespace sidewall::app
