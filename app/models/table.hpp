#pragma once
#include <filesystem>
#include <vector>

#include "app/schema/units.hpp"
#include "flux/species.hpp"

// Measured or computed numbers that a recipe reads from files.
namespace sidewall::app {

/// A function of one or two numbers on a grid: linear in each between its points, constant beyond them.
struct Table {
    std::vector<double> first, second;  ///< rising; second is empty for a function of one number
    std::vector<double> values;         ///< first varies slowest

    double operator()(double a, double b = 0.0) const;
};

/// Reads `a,value` or `a,b,value` from a CSV file, whatever its columns are called: the last one is the value, and every
/// combination of the others stands there once, in any order. Columns whose headings have units are converted to \p units.
/// \throws FileError naming the file and what is missing.
Table read_table(const std::filesystem::path& path, const Units& units = {});

/// Reads a joint histogram of ions' energies (eV) and angles from the source's axis (degree) from a CSV file with the
/// columns energy_from, energy_to, angle_from, angle_to, weight, in any order: a bin a row.
/// \throws FileError naming the file and the row that is none.
std::vector<flux::SourceBin> read_source(const std::filesystem::path& path);

/// Reads how many neutrals come from which angle to the source's axis (degree) from a CSV file: a histogram with the
/// columns angle_from, angle_to and weight, a bin a row; or what a target sends per solid angle, with the columns angle
/// and intensity, linear between the rows, constant below the first angle and 0 beyond the last. The latter becomes bins
/// of at most a quarter of a degree, which hold their exact shares.
/// \throws FileError naming the file and the row that is none.
std::vector<flux::SourceBin> read_source_angles(const std::filesystem::path& path);

}  // namespace sidewall::app
