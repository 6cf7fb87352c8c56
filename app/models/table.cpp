#include "app/models/table.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "app/common/csv.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

// Where x lies between the points of an axis: the lower one, and the part of the way to the next.
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

Table read_table(const std::filesystem::path& path) {
    const CsvColumns csv = read_csv(path);
    if (csv.columns.size() != 2 && csv.columns.size() != 3)
        throw FileError(
            fmt::format("{}: has {} columns; a table has one or two of arguments and one of values",
                        path.string(), csv.columns.size()));
    Table table;
    table.first = axis_of(csv.columns[0]);
    if (csv.columns.size() == 3) table.second = axis_of(csv.columns[1]);
    const std::size_t stride = std::max<std::size_t>(table.second.size(), 1), rows = csv.columns[0].size();
    if (table.first.size() > rows || table.first.size() * stride != rows)
        throw FileError(fmt::format("{}: has {} rows for a grid of {} by {}: every combination once",
                                    path.string(), rows, table.first.size(), stride));
    table.values.assign(rows, std::numeric_limits<double>::quiet_NaN());
    for (std::size_t r = 0; r < rows; ++r) {
        const std::size_t i = index_on(table.first, csv.columns[0][r]);
        const std::size_t k = table.second.empty() ? 0 : index_on(table.second, csv.columns[1][r]);
        double& value = table.values[i * stride + k];
        if (!std::isnan(value))
            throw FileError(fmt::format(
                "{}: has two values at {} = {:.6g}{}", path.string(), csv.names[0], csv.columns[0][r],
                table.second.empty() ? "" : fmt::format(", {} = {:.6g}", csv.names[1], csv.columns[1][r])));
        value = csv.columns.back()[r];
    }
    return table;
}

std::vector<flux::SourceBin> read_source(const std::filesystem::path& path) {
    const CsvColumns csv = read_csv(path);
    const auto column = [&](const char* name) -> const std::vector<double>& {
        const auto found = std::find(csv.names.begin(), csv.names.end(), name);
        if (found == csv.names.end())
            throw FileError(
                fmt::format("{}: has no column {}; a source has energy_from, energy_to, angle_from, angle_to "
                            "and weight, and this file {}",
                            path.string(), name, fmt::join(csv.names, ", ")));
        return csv.columns[static_cast<std::size_t>(found - csv.names.begin())];
    };
    const auto &energy_from = column("energy_from"), &energy_to = column("energy_to"),
               &angle_from = column("angle_from"), &angle_to = column("angle_to"), &weight = column("weight");
    constexpr double kRadians = std::numbers::pi / 180.0;
    std::vector<flux::SourceBin> bins;
    double total = 0.0;
    for (std::size_t r = 0; r < weight.size(); ++r) {
        const bool energies = energy_from[r] >= 0.0 && energy_to[r] >= energy_from[r] && energy_to[r] > 0.0 &&
                              energy_to[r] <= 1e6;
        const bool angles = angle_from[r] >= 0.0 && angle_to[r] >= angle_from[r] && angle_to[r] < 90.0;
        if (!energies || !angles || weight[r] < 0.0)
            throw FileError(fmt::format(
                "{}: row {} of the bins: energies must rise within [0, 1e6] eV, angles within [0, 90) degrees, and "
                "the weight must be 0 or more",
                path.string(), r + 1));
        if (weight[r] == 0.0) continue;
        total += weight[r];
        bins.push_back(
            {kRadians * angle_from[r], kRadians * angle_to[r], energy_from[r], energy_to[r], total});
    }
    if (!(total > 0.0) || !std::isfinite(total))
        throw FileError(fmt::format("{}: its weights add up to {:g}", path.string(), total));
    for (flux::SourceBin& bin : bins) bin.until /= total;
    bins.back().until = 1.0;
    return bins;
}

}  // namespace sidewall::app
