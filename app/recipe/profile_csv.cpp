#include "app/recipe/profile_csv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "app/common/text.hpp"
#include "app/recipe/layer_checks.hpp"
#include "app/recipe/layers.hpp"
#include "app/recipe/polygon_checks.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

constexpr std::uintmax_t kMostCsvBytes = 100'000'000;
constexpr std::size_t kMostPoints = 1'000'000;

// Whether the text is one finite number of a sensible size.
bool read(std::string_view text, double& number) {
    text = trimmed(text);
    const auto value = finite_number(text.substr(text.starts_with('+') ? 1 : 0));
    number = value.value_or(0.0);
    return value && std::abs(number) <= kHuge;
}

}  // namespace

levelset::Polygon read_profile(const std::filesystem::path& path) {
    std::error_code failure;
    if (std::filesystem::file_size(path, failure) > kMostCsvBytes && !failure)
        throw FileError(fmt::format("{}: larger than {} MB: give fewer points", path.string(),
                                    kMostCsvBytes / 1'000'000));
    const std::string text = surface::read_whole_file(path);
    levelset::Polygon points;
    bool names_allowed = true;
    std::size_t number = 0;
    for (std::size_t begin = 0; begin < text.size(); ++number) {
        const std::size_t end = std::min(text.find('\n', begin), text.size());
        std::string_view line(text.data() + begin, end - begin);
        begin = end + 1;
        line = trimmed(line.substr(0, line.find('#')));
        if (line.empty()) continue;
        const std::size_t comma = line.find_first_of(",;");
        std::array<double, 2> point{};
        const bool good = comma != std::string_view::npos && read(line.substr(0, comma), point[0]) &&
                          read(line.substr(comma + 1), point[1]);
        // A first line whose words are no numbers names the columns.
        double ignored = 0.0;
        const bool names = names_allowed && !read(line.substr(0, comma), ignored);
        names_allowed = false;
        if (!good && names) continue;
        if (!good)
            throw FileError(fmt::format(
                "{}:{}: \"{}\": must be two numbers, x and z with a comma between them, at most "
                "{:g}",
                path.string(), number + 1, surface::printable(std::string(line.substr(0, 40))), kHuge));
        if (points.empty() || points.back() != point) points.push_back(point);
        if (points.size() > kMostPoints)
            throw FileError(
                fmt::format("{}:{}: over {} points: give fewer", path.string(), number + 1, kMostPoints));
    }
    if (points.size() < 2)
        throw FileError(
            fmt::format("{}:{}: holds fewer than two different points: give x and z, a point a line",
                        path.string(), number));
    return points;
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
        throw KeyError(
            "file", fmt::format("goes down to x = {:g}: in a revolution x is the distance from the axis, at "
                                "least 0; or set sweep = \"extrusion\"",
                                low[0]));
    const double wide = turned ? high[0] : high[0] - low[0], tall = high[1] - low[1];
    const double top = std::max(std::abs(*layer.top + low[1]), std::abs(*layer.top + high[1]));
    if (top > kMostCells * domain.spacing)
        throw KeyError(
            "file", fmt::format("reaches {:.3g} cells from z = 0, over {:g}; check the unit or use a larger "
                                "grid_spacing",
                                top / domain.spacing, kMostCells));
    if (closed && std::min(wide, tall) < kFewestCells * domain.spacing)
        throw KeyError(
            "file", fmt::format("the outline is only {:.3g} cells {}, and the grid loses what is under {:g}: "
                                "use a grid_spacing of {:.2g} or less",
                                std::min(wide, tall) / domain.spacing, wide < tall ? "wide" : "high",
                                kFewestCells, std::min(wide, tall) / 6.0));
    const double from = layer.position[0] + (turned ? -high[0] : low[0]), to = layer.position[0] + high[0];
    if (domain.side[0] == levelset::Side::reflective && (to <= domain.min[0] || from >= domain.max[0]))
        throw KeyError(
            "file",
            fmt::format("lies from x = {:g} to {:g}, outside the domain's {:g} to {:g}; check unit and "
                        "position",
                        from, to, domain.min[0], domain.max[0]));
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
