#pragma once
#include <string>
#include <vector>

// The units that recipes accept.
namespace sidewall::app {

const std::vector<std::string>& length_units();
const std::vector<std::string>& time_units();

/// The metres in a length unit, and the seconds in a time unit.
/// \pre the unit is one that recipes accept.
double metres_in(const std::string& length_unit);
double seconds_in(const std::string& time_unit);

/// A key's unit such as "length/time" written in a recipe's units, e.g. "um/s".
std::string unit_text(const std::string& unit, const std::string& length_unit, const std::string& time_unit);

}  // namespace sidewall::app
