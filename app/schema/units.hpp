#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/common/text.hpp"

// The units that recipes accept.
namespace sidewall::app {

/// The units of a recipe.
struct Units {
    std::string length = "um", time = "s";
};

const std::vector<std::string>& length_units();
const std::vector<std::string>& time_units();

/// The size of a length unit in metres. Besides the units of recipes it knows micron and angstrom and their
/// symbols, which tables of other programs use. Nothing for another text.
std::optional<double> find_length(std::string_view unit);

/// The size of a length unit in metres, and of a time unit in seconds.
/// \pre the unit is one that recipes accept.
double metres_in(const std::string& length_unit);
double seconds_in(const std::string& time_unit);

/// The size of a length, a time, or a length over a time such as "nm/min", in a recipe's units; else nothing.
std::optional<double> size_in(const Units& units, const std::string& unit);

/// Converts columns that size_in() has a size for to the recipe's units, and adds that to `understood`.
/// Columns without a unit or in 1, %, eV, degrees, rad, K or Pa stay unchanged.
/// \throws FileError for another unit.
void convert_columns(CsvTable& table, const Units& units);

/// A key's unit such as "length/time" written in a recipe's units, e.g. "um/s".
std::string unit_text(const std::string& unit, const std::string& length_unit, const std::string& time_unit);

}  // namespace sidewall::app
