#pragma once
#include <filesystem>
#include <vector>

#include "app/schema/units.hpp"
#include "flux/species.hpp"

// Numbers that a recipe reads from files.
namespace sidewall::app {

/// A function of one or two numbers on a rectangular grid: linear between grid points, constant outside.
struct Table {
    std::vector<double> first, second;  ///< ascending; second is empty for a function of one number
    std::vector<double> values;         ///< first varies slowest

    double operator()(double a, double b = 0.0) const;
};

/// Reads `a,value` or `a,b,value` from a CSV file, under any headings; the last column is the value. Each
/// combination of arguments occurs once, in any order. Columns with units are converted to \p units.
/// \throws FileError naming the file and what is missing.
Table read_table(const std::filesystem::path& path, const Units& units = {});

/// Reads the joint histogram of ion energies (eV) and angles from the source's axis (degree) from a CSV file
/// with the columns energy_from, energy_to, angle_from, angle_to, weight, in any order; each row is a bin.
/// \throws FileError naming the file and the invalid row.
std::vector<flux::SourceBin> read_source(const std::filesystem::path& path);

/// Reads the angular distribution of neutrals about the source's axis (degree) from a CSV file. It is a
/// histogram with the columns angle_from, angle_to and weight; or an intensity per solid angle with the
/// columns angle and intensity: linear between rows, constant below the first angle, 0 beyond the last,
/// integrated exactly over bins of at most a quarter of a degree.
/// \throws FileError naming the file and the invalid row.
std::vector<flux::SourceBin> read_source_angles(const std::filesystem::path& path);

}  // namespace sidewall::app
