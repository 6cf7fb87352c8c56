#include "app/schema/units.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

namespace sidewall::app {
namespace {

using Unit = std::pair<const char*, double>;  // its name, in metres or seconds

constexpr std::array kLengths{Unit{"nm", 1e-9}, Unit{"um", 1e-6}, Unit{"mm", 1e-3}, Unit{"cm", 1e-2},
                              Unit{"m", 1.0}};
constexpr std::array kTimes{Unit{"ms", 1e-3}, Unit{"s", 1.0}, Unit{"min", 60.0}, Unit{"h", 3600.0}};

template <class Units>
std::vector<std::string> names_of(const Units& units) {
    std::vector<std::string> names;
    names.reserve(units.size());
    for (const Unit& unit : units) names.emplace_back(unit.first);
    return names;
}

template <class Units>
double size_of(const Units& units, const std::string& name) {
    return std::find_if(units.begin(), units.end(), [&](const Unit& unit) { return name == unit.first; })
        ->second;
}

}  // namespace

const std::vector<std::string>& length_units() {
    static const std::vector<std::string> names = names_of(kLengths);
    return names;
}

const std::vector<std::string>& time_units() {
    static const std::vector<std::string> names = names_of(kTimes);
    return names;
}

double metres_in(const std::string& length_unit) {
    return size_of(kLengths, length_unit);
}

double seconds_in(const std::string& time_unit) {
    return size_of(kTimes, time_unit);
}

std::string unit_text(const std::string& unit, const std::string& length_unit, const std::string& time_unit) {
    std::string text = unit;
    for (const auto& [word, name] : {std::pair("length", length_unit), std::pair("time", time_unit)})
        if (const std::size_t at = text.find(word); at != std::string::npos)
            text.replace(at, std::string_view(word).size(), name);
    return text;
}

}  // namespace sidewall::app
