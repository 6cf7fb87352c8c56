#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "app/common/json_fwd.hpp"

namespace sidewall::app {

struct StudyOptions {
    std::filesystem::path output;
    std::filesystem::path recipes;  ///< folder with surface1.toml and surface2.toml
    std::vector<int> surfaces{1, 2};
    int grid_levels = 0;    ///< levels of the grids that surfaces grow on; 0: as in the recipes
    double rays = 1e7;      ///< source rays of every timed trace
    double sticking = 0.1;  ///< sticking probability of the traced neutral
    std::vector<double> removals{0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9};  ///< shares of vertices removed
    bool quiet = false;
    bool overwrite = false;  ///< as in RunOptions
};

/// Repeats the evaluation of region simplification (Lenz 2023, section 8.3, Figures 8.8 to 8.13) on surfaces
/// that the recipes grow: distance to the original, simplification time and tracing time of every method at
/// equal numbers of vertices. Writes DIR/{study.json, study.csv, report.md, surfaceN*.vtp}; results are saved
/// after every share of vertices removed, so that an interrupted study keeps them.
/// \returns what study.json holds.
/// \throws FileError if a recipe is missing; Interrupted, after the current calculation, if asked to stop.
Json run_study(const StudyOptions& options);

/// The report of a study, from its study.json, in Markdown: a verdict on each of the chapter's claims.
std::string study_report(const Json& study);

}  // namespace sidewall::app
