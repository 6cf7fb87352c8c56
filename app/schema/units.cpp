#include "app/schema/units.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <utility>

#include "surface/error.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

using Unit = std::pair<const char*, double>;  // name, and size in metres or seconds

constexpr std::array kLengths{Unit{"nm", 1e-9}, Unit{"um", 1e-6}, Unit{"mm", 1e-3}, Unit{"cm", 1e-2},
                              Unit{"m", 1.0}};
constexpr std::array kTimes{Unit{"ms", 1e-3}, Unit{"s", 1.0}, Unit{"min", 60.0}, Unit{"h", 3600.0}};

// Further names in tables of other programs: um with the micro sign or the Greek mu, and the Angstrom.
constexpr std::array kOthers{Unit{"\xc2\xb5m", 1e-6}, Unit{"\xce\xbcm", 1e-6}, Unit{"micron", 1e-6},
                             Unit{"\xc3\x85", 1e-10}, Unit{"angstrom", 1e-10}};

template <class List>
std::vector<std::string> names_of(const List& units) {
    std::vector<std::string> names;
    names.reserve(units.size());
    for (const Unit& unit : units) names.emplace_back(unit.first);
    return names;
}

template <class List>
std::optional<double> find_size(const List& units, std::string_view name) {
    const auto unit = std::ranges::find_if(units, [&](const Unit& one) { return name == one.first; });
    return unit == units.end() ? std::nullopt : std::optional(unit->second);
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

std::optional<double> find_length(std::string_view unit) {
    const auto size = find_size(kLengths, unit);
    return size ? size : find_size(kOthers, unit);
}

double metres_in(const std::string& length_unit) {
    return find_length(length_unit).value();
}

double seconds_in(const std::string& time_unit) {
    return find_size(kTimes, time_unit).value();
}

std::optional<double> size_in(const Units& units, const std::string& unit) {
    if (const auto length = find_length(unit)) return *length / metres_in(units.length);
    if (const auto time = find_size(kTimes, unit)) return *time / seconds_in(units.time);
    const std::size_t slash = unit.find('/');
    if (slash == std::string::npos) return std::nullopt;
    const auto length = find_length(std::string_view(unit).substr(0, slash));
    const auto time = find_size(kTimes, std::string_view(unit).substr(slash + 1));
    if (!length || !time) return std::nullopt;
    return *length / *time * seconds_in(units.time) / metres_in(units.length);
}

void convert_columns(CsvTable& table, const Units& units) {
    static constexpr std::array<std::string_view, 10> kNeither{"",       "1",       "%",   "eV", "deg",
                                                               "degree", "degrees", "rad", "K",  "Pa"};
    bool converted = false;
    for (CsvColumn& column : table.columns) {
        const auto size = size_in(units, column.unit);
        if (!size && std::ranges::find(kNeither, column.unit) == kNeither.end())
            throw FileError(
                "{}: {} [{}]: the unit is unknown: write a length ({}), a time ({}), such as nm/min a quotient of the two, "
                "or eV, deg, K, Pa or 1, which are taken as they are",
                table.file, surface::printable(column.name), surface::printable(column.unit),
                fmt::join(length_units(), ", "), fmt::join(time_units(), ", "));
        if (!size || *size == 1.0) continue;
        converted = true;
        for (double& value : column.values) value *= *size;
    }
    if (converted)
        table.understood += fmt::format(", converted to the recipe's {} and {}", units.length, units.time);
}

std::string unit_text(const std::string& unit, const std::string& length_unit, const std::string& time_unit) {
    std::string text = unit;
    for (const auto& [word, name] : {std::pair("length", length_unit), std::pair("time", time_unit)})
        if (const std::size_t at = text.find(word); at != std::string::npos)
            text.replace(at, std::string_view(word).size(), name);
    return text;
}

}  // namespace sidewall::app
