#pragma once
#include <filesystem>
#include <vector>

#include "app/common/json_fwd.hpp"

namespace sidewall::app {

/// What `sidewall study` measures, and with how many rays and repeats.
struct StudyOptions {
    std::filesystem::path output;
    std::filesystem::path recipes;  ///< folder with surface1.toml and surface2.toml
    std::vector<int> surfaces{1, 2};
    int grid_levels = 0;         ///< of the grids that they are grown on; 0: as the recipes say
    double rays = 1e7;           ///< source rays of every timed trace
    double sticking = 0.1;       ///< of the traced neutral
    double low_sticking = 0.01;  ///< of another one that the five ways are compared at, too
    bool radiosity = false;      ///< finds the timed fluxes; the true ones are traced
    double flux_error = 0.02;    ///< relative L2 error that times are extrapolated to
    int repeats = 3;             ///< simplification times are medians of so many
    std::vector<double> removals{0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9};  ///< share of vertices removed
    bool quiet = false;
    bool overwrite = false;  ///< as in RunOptions
};

/// Redoes the evaluation of region simplification (Lenz 2023, section 8.3) on surfaces that the recipes grow:
/// distance to the original, simplification time, tracing time, and flux error, of every method at equal
/// numbers of vertices; and what five ways to the flux take to the same error at every depth, see five_ways.hpp.
///
/// Writes DIR/{study.json, study.csv, five_ways.csv, report.md, *.svg, surfaceN*.vtp}; what is finished is saved after every
/// mesh, so that an interrupted study keeps it.
/// \returns what study.json holds.
/// \throws FileError if a recipe is missing, Interrupted after the mesh at hand if the user asked to stop.
Json run_study(const StudyOptions& options);

/// The report in Markdown: tables and the verdict on each of the chapter's claims.
std::string study_report(const Json& study);

/// All rows as comma separated values.
std::string study_csv(const Json& study);

/// Figures by file name, as SVG.
std::vector<std::pair<std::string, std::string>> study_figures(const Json& study);

}  // namespace sidewall::app
