#include "app/recipe/profile_csv.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "app/recipe/layer_checks.hpp"
#include "app/recipe/layers.hpp"
#include "app/recipe/polygon_checks.hpp"
#include "app/schema/units.hpp"
#include "surface/error.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

// Columns of x (or y, or r) and of z, by their headings; else the first two.
std::array<std::size_t, 2> profile_columns(const CsvTable& table) {
    std::array<std::size_t, 2> columns{0, 1};
    for (std::size_t k = table.columns.size(); table.headed && k-- > 0;) {
        const std::string& name = table.columns[k].name;
        if (name.size() != 1) continue;
        if (std::string_view("xXyYrR").find(name[0]) != std::string_view::npos) columns[0] = k;
        if (name[0] == 'z' || name[0] == 'Z') columns[1] = k;
    }
    return columns;
}

}  // namespace

ProfileTable read_points(const std::filesystem::path& path, const std::string& length_unit,
                         std::size_t most) {
    const CsvTable table = read_csv(path, most);
    if (table.columns.size() < 2 || (table.columns.size() > 2 && !table.headed))
        throw FileError("{}: has {} columns{}: a profile has rows x,z", table.file, table.columns.size(),
                        table.headed ? "" : " without headings");
    const std::array<std::size_t, 2> columns = profile_columns(table);
    ProfileTable profile{.points = levelset::Polygon(table.columns[0].values.size()),
                         .understood = table.understood};
    const auto line = std::ranges::find(table.columns, "polyline", &CsvColumn::name);
    if (line != table.columns.end())
        profile.several = std::ranges::any_of(line->values, [&](double k) { return k != line->values[0]; });
    for (std::size_t a = 0; a < 2; ++a) {
        const CsvColumn& column = table.columns[columns[a]];
        const std::string& unit = column.unit.empty() ? table.columns[columns[1 - a]].unit : column.unit;
        const auto metres = find_length(unit);
        if (!unit.empty() && !metres)
            throw FileError("{}: its heading says {}, which is no length unit: must be {}", table.file,
                            surface::printable(unit), fmt::join(length_units(), ", "));
        const double size = metres ? *metres / metres_in(length_unit) : 1.0;
        if (a == 0 && metres) profile.understood += fmt::format(", in {} here", length_unit);
        const std::vector<double>& numbers = numbers_of(column);
        for (std::size_t r = 0; r < numbers.size(); ++r) {
            profile.points[r][a] = numbers[r] * size;
            if (std::abs(profile.points[r][a]) > kHuge)
                throw FileError("{}: {:g} in {} is over {:g}", table.file, numbers[r],
                                surface::printable(column.name), kHuge);
        }
    }
    return profile;
}

ProfileTable read_profile(const std::filesystem::path& path, const std::string& length_unit) {
    ProfileTable profile = read_points(path, length_unit);
    if (profile.several)
        throw FileError("{}: its column polyline lists several lines: keep the rows of one", path.string());
    levelset::Polygon& points = profile.points;
    points.erase(std::unique(points.begin(), points.end()), points.end());
    if (points.size() < 2)
        throw FileError("{}: holds fewer than two different points: give x and z, a point a line",
                        path.string());
    return profile;
}

void check_profile(const Layer& layer, const levelset::Polygon& points, bool first,
                   const levelset::Domain& domain) {
    const bool closed = points.front() == points.back(), turned = layer.sweep == "revolution";
    if (closed && first)
        throw KeyError(
            "file",
            "is a closed outline, which stands on a substrate: put another layer before it, or give "
            "a curve, whose last point is not the first");
    double low[2], high[2];
    for (std::size_t a = 0; a < 2; ++a) {
        const auto [least, most] = std::minmax_element(
            points.begin(), points.end(), [&](const auto& p, const auto& q) { return p[a] < q[a]; });
        low[a] = (*least)[a];
        high[a] = (*most)[a];
    }
    if (turned && low[0] < 0.0)
        raise_key("file",
                  "goes down to x = {:g}: in a revolution x is the distance from the axis, at "
                  "least 0; or set sweep = \"extrusion\"",
                  low[0]);
    const double wide = turned ? high[0] : high[0] - low[0], tall = high[1] - low[1];
    const double top = std::max(std::abs(*layer.top + low[1]), std::abs(*layer.top + high[1]));
    if (top > kMostCells * domain.spacing)
        raise_key("file",
                  "reaches {:.3g} cells from z = 0, over {:g}; check the unit or use a larger "
                  "grid_spacing",
                  top / domain.spacing, kMostCells);
    if (closed && std::min(wide, tall) < kFewestCells * domain.spacing)
        raise_key("file",
                  "the outline is only {:.3g} cells {}, and the grid loses shapes under {:g} "
                  "cells: use a grid_spacing of {:.2g} or less",
                  std::min(wide, tall) / domain.spacing, wide < tall ? "wide" : "high", kFewestCells,
                  std::min(wide, tall) / 6.0);
    const double from = layer.position[0] + (turned ? -high[0] : low[0]), to = layer.position[0] + high[0];
    if (domain.side[0] == levelset::Side::reflective && (to <= domain.min[0] || from >= domain.max[0]))
        raise_key("file",
                  "lies from x = {:g} to {:g}, outside the domain's {:g} to {:g}; check unit and "
                  "position",
                  from, to, domain.min[0], domain.max[0]);
    levelset::Polygon outline = points;
    if (!closed) {
        if (points.front()[0] == points.back()[0])
            throw KeyError("file", "must go from one side to the other, or end where it began");
        if (points.front()[0] > points.back()[0]) std::reverse(outline.begin(), outline.end());
        const double far = 2.0 * (wide + tall);
        outline.insert(outline.begin(), {{low[0] - far, low[1] - far}, {low[0] - far, outline.front()[1]}});
        outline.insert(outline.end(), {{high[0] + far, outline.back()[1]}, {high[0] + far, low[1] - far}});
    }
    check_outline(outline, "file");
}

}  // namespace sidewall::app
