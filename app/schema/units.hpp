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

/// The metres in a length unit of a recipe or of a table, which may say micron, angstrom and the letters of these, too;
/// nothing for another text.
std::optional<double> find_length(std::string_view unit);

/// The metres in a length unit, and the seconds in a time unit.
/// \pre the unit is one that recipes accept.
double metres_in(const std::string& length_unit);
double seconds_in(const std::string& time_unit);

/// The size of a length, a time or a quotient of the two, such as "nm/min", in a recipe's units; nothing for another unit.
std::optional<double> size_in(const Units& units, const std::string& unit);

/// Converts the columns whose headings have such a unit into the recipe's, and tells so in `understood`; leaves those in eV,
/// deg, K, Pa or 1 as they are.
/// \throws FileError for another unit.
void convert_columns(CsvTable& table, const Units& units);

/// A key's unit such as "length/time" written in a recipe's units, e.g. "um/s".
std::string unit_text(const std::string& unit, const std::string& length_unit, const std::string& time_unit);

}  // namespace sidewall::app
