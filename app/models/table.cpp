#include "app/models/table.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "surface/error.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

// Position between two points of an axis: index of the lower one and fraction of the interval, 0 to 1.
struct Place {
    std::size_t lower;
    double part;
};

Place place_on(const std::vector<double>& axis, double x) {
    if (axis.size() < 2 || !(x > axis.front())) return {0, 0.0};
    if (x >= axis.back()) return {axis.size() - 2, 1.0};
    const auto above = std::upper_bound(axis.begin(), axis.end(), x);
    const auto lower = static_cast<std::size_t>(above - axis.begin()) - 1;
    return {lower, (x - axis[lower]) / (axis[lower + 1] - axis[lower])};
}

std::vector<double> axis_of(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    values.erase(std::unique(values.begin(), values.end()), values.end());
    return values;
}

std::size_t index_on(const std::vector<double>& axis, double x) {
    return static_cast<std::size_t>(std::lower_bound(axis.begin(), axis.end(), x) - axis.begin());
}

constexpr double kRadians = std::numbers::pi / 180.0;
constexpr double kFlattest = 90.0 * kRadians - 1e-8;  // largest angle that tracing accepts, and a margin

// The named column, in degree, eV or no unit. For messages, \p all lists the required columns.
const std::vector<double>& column_of(const CsvTable& csv, const char* name, const char* all) {
    const auto found = std::ranges::find(csv.columns, name, &CsvColumn::name);
    if (found == csv.columns.end()) {
        std::vector<std::string> names;
        names.reserve(csv.columns.size());
        for (const CsvColumn& column : csv.columns) names.push_back(surface::printable(column.name));
        throw FileError("{}: has no column {}; a source has {}, and this file {}", csv.file, name, all,
                        fmt::join(names, ", "));
    }
    if (std::ranges::count(csv.columns, name, &CsvColumn::name) > 1)
        throw FileError("{}: has more than one column {}: keep one of them", csv.file, name);
    constexpr std::string_view kUnits[] = {"", "eV", "deg", "degree", "degrees", "\xc2\xb0"};
    if (std::ranges::find(kUnits, found->unit) == std::end(kUnits))
        throw FileError("{}: {} is in {}: give angles in degree and energies in eV", csv.file, name,
                        surface::printable(found->unit));
    return numbers_of(*found);
}

// Turns running sums of weights, which end at `total`, into cumulative shares, which end at 1. Leaves out
// bins that are lost in the rounding of the sum.
std::vector<flux::SourceBin> shared_out(const std::vector<flux::SourceBin>& bins, double total,
                                        const std::string& file) {
    if (!(total > 0.0) || !std::isfinite(total))
        throw FileError(
            "{}: its weights add up to {:g}: give {}", file, total,
            total > 0.0 ? "smaller ones, their ratios count" : "rows of a wider angle or a larger weight");
    std::vector<flux::SourceBin> kept;
    for (flux::SourceBin bin : bins) {
        bin.until /= total;
        if (bin.until > (kept.empty() ? 0.0 : kept.back().until)) kept.push_back(bin);
    }
    return kept;
}

// One bin a row: angles and, with \p energies, energies. \p all lists the columns for messages.
std::vector<flux::SourceBin> bins_of_histogram(const CsvTable& csv, bool energies, const char* all) {
    const std::vector<double> none(csv.columns[0].values.size(), 0.0);
    const auto column = [&](const char* name, bool wanted = true) -> const std::vector<double>& {
        return wanted ? column_of(csv, name, all) : none;
    };
    const auto &energy_from = column("energy_from", energies), &energy_to = column("energy_to", energies),
               &angle_from = column("angle_from"), &angle_to = column("angle_to"), &weight = column("weight");
    std::vector<flux::SourceBin> bins;
    double total = 0.0;
    for (std::size_t r = 0; r < weight.size(); ++r) {
        const bool rise = !energies || (energy_from[r] >= 0.0 && energy_to[r] >= energy_from[r] &&
                                        energy_to[r] > 0.0 && energy_to[r] <= 1e6);
        const bool angles = angle_from[r] >= 0.0 && angle_to[r] >= angle_from[r] && angle_to[r] < 90.0;
        if (!rise || !angles || !(weight[r] >= 0.0))
            throw FileError(
                "{}: row {} of the bins: {} must rise within [0, 90) degrees, and the weight must be 0 or more",
                csv.file, r + 1, energies ? "energies must rise within [0, 1e6] eV, angles" : "angles");
        if (weight[r] == 0.0) continue;
        total += weight[r];
        bins.push_back({std::min(kRadians * angle_from[r], kFlattest),
                        std::min(kRadians * angle_to[r], kFlattest), energy_from[r], energy_to[r], total});
    }
    return shared_out(bins, total, csv.file);
}

}  // namespace

double Table::operator()(double a, double b) const {
    if (std::isnan(a) || std::isnan(b)) return std::numeric_limits<double>::quiet_NaN();
    const std::size_t stride = std::max<std::size_t>(second.size(), 1);
    const Place p = place_on(first, a), q = place_on(second, b);
    const auto row = [&](std::size_t i) {
        const double* v = values.data() + std::min(i, first.size() - 1) * stride;
        return q.part == 0.0 ? v[q.lower] : (1.0 - q.part) * v[q.lower] + q.part * v[q.lower + 1];
    };
    return p.part == 0.0 ? row(p.lower) : (1.0 - p.part) * row(p.lower) + p.part * row(p.lower + 1);
}

Table read_table(const std::filesystem::path& path, const Units& units) {
    CsvTable csv = read_csv(path);
    convert_columns(csv, units);
    if (csv.columns.size() != 2 && csv.columns.size() != 3)
        throw FileError("{}: has {} columns; a table has one or two of arguments and one of values",
                        path.string(), csv.columns.size());
    Table table;
    table.first = axis_of(numbers_of(csv.columns[0]));
    if (csv.columns.size() == 3) table.second = axis_of(numbers_of(csv.columns[1]));
    const std::size_t stride = std::max<std::size_t>(table.second.size(), 1),
                      rows = csv.columns[0].values.size();
    if (table.first.size() > rows || table.first.size() * stride != rows)
        throw FileError("{}: has {} rows for a grid of {} by {}: every combination once", path.string(), rows,
                        table.first.size(), stride);
    table.values.assign(rows, std::numeric_limits<double>::quiet_NaN());
    for (std::size_t r = 0; r < rows; ++r) {
        const std::size_t i = index_on(table.first, csv.columns[0].values[r]);
        const std::size_t k = table.second.empty() ? 0 : index_on(table.second, csv.columns[1].values[r]);
        double& value = table.values[i * stride + k];
        if (!std::isnan(value))
            throw FileError("{}: has two values at {} = {:.6g}{}", path.string(),
                            surface::printable(csv.columns[0].name), csv.columns[0].values[r],
                            table.second.empty()
                                ? ""
                                : fmt::format(", {} = {:.6g}", surface::printable(csv.columns[1].name),
                                              csv.columns[1].values[r]));
        value = numbers_of(csv.columns.back())[r];
    }
    return table;
}

std::vector<flux::SourceBin> read_source(const std::filesystem::path& path) {
    return bins_of_histogram(read_csv(path), true, "energy_from, energy_to, angle_from, angle_to and weight");
}

namespace {

// Antiderivative of (p + q a) sin a.
double sine_integral(double p, double q, double a) {
    return q * std::sin(a) - (p + q * a) * std::cos(a);
}

std::vector<flux::SourceBin> bins_of_intensity(const CsvTable& csv) {
    constexpr double kWidest = 0.25 * kRadians;
    std::vector<double> angle = column_of(csv, "angle", "angle and intensity"),
                        intensity = column_of(csv, "intensity", "angle and intensity");
    for (std::size_t r = 0; r < angle.size(); ++r)
        if (!(angle[r] >= 0.0 && angle[r] <= 90.0) || !(intensity[r] >= 0.0) ||
            (r > 0 && angle[r] <= angle[r - 1]))
            throw FileError(
                "{}: row {}: angles must rise within [0, 90] degrees, and the intensity must "
                "be 0 or more",
                csv.file, r + 1);
    if (!angle.empty() && angle.front() > 0.0) {
        angle.insert(angle.begin(), 0.0);
        intensity.insert(intensity.begin(), intensity.front());
    }
    std::vector<flux::SourceBin> bins;
    double total = 0.0;
    for (std::size_t r = 0; r + 1 < angle.size(); ++r) {
        const double from = kRadians * angle[r], to = std::min(kRadians * angle[r + 1], kFlattest);
        const double q = (intensity[r + 1] - intensity[r]) / (kRadians * (angle[r + 1] - angle[r])),
                     p = intensity[r] - q * from;
        const int parts = std::max(1, static_cast<int>(std::ceil((to - from) / kWidest - 1e-9)));
        for (int i = 0; i < parts; ++i) {
            const double low = from + (to - from) * i / parts, high = from + (to - from) * (i + 1) / parts;
            const double share = sine_integral(p, q, high) - sine_integral(p, q, low);
            if (!(share > 0.0)) continue;
            total += share;
            bins.push_back({low, high, 0.0, 0.0, total});
        }
    }
    return shared_out(bins, total, csv.file);
}

}  // namespace

std::vector<flux::SourceBin> read_source_angles(const std::filesystem::path& path) {
    const CsvTable csv = read_csv(path);
    const auto has = [&](const char* name) {
        return std::ranges::find(csv.columns, name, &CsvColumn::name) != csv.columns.end();
    };
    if (has("energy_from") || has("energy_to"))
        throw FileError("{}: has energies, which only ions have; drop these columns, or set kind = \"ion\"",
                        path.string());
    if (has("intensity")) return bins_of_intensity(csv);
    return bins_of_histogram(csv, false, "angle_from, angle_to and weight, or angle and intensity");
}

}  // namespace sidewall::app
