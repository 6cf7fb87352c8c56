#include "app/evaluation/validate_chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "app/common/json.hpp"
#include "surface/files/vtk_writer.hpp"

namespace sidewall::app {
namespace {

constexpr double kWide = 30.0;  // positive values that differ by more than this factor get a logarithmic axis
constexpr double kWidth = 560.0, kHeight = 300.0, kLeft = 64.0, kRight = 150.0, kTop = 12.0, kBottom = 44.0;
constexpr double kMostHeight = 620.0;
constexpr const char* kColours[] = {"#c2410c", "#2563eb", "#2563eb", "#2563eb"};

using Point = std::array<double, 2>;

// An axis, which maps values to pixels. `low` and `high` are logarithms on a logarithmic axis.
struct Axis {
    double low = 0.0, high = 1.0, from = 0.0, to = 1.0;
    bool logarithmic = false;

    double scaled(double value) const { return logarithmic ? std::log10(value) : value; }
    double at(double value) const { return from + (scaled(value) - low) / (high - low) * (to - from); }
    // Round values for ticks, at most about eight.
    std::vector<double> ticks() const {
        const double rough = (high - low) / 6.0, decade = std::pow(10.0, std::floor(std::log10(rough)));
        double step = 10.0 * decade;
        for (const double factor : {5.0, 2.0, 1.0})
            if (factor * decade >= rough) step = factor * decade;
        if (logarithmic) step = std::max(1.0, std::round(step));
        std::vector<double> values;
        for (double k = std::ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k)
            values.push_back(logarithmic ? std::pow(10.0, k * step) : k * step + 0.0);  // no -0
        return values;
    }
};

Axis axis_over(const std::vector<double>& values, bool logarithmic) {
    Axis axis{.logarithmic = logarithmic};
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    axis.low = axis.scaled(*low);
    axis.high = axis.scaled(*high);
    const double margin =
        axis.high > axis.low ? 0.05 * (axis.high - axis.low) : 0.05 * std::abs(axis.low) + 1e-9;
    axis.low -= margin;
    axis.high += margin;
    return axis;
}

// The points of a series; nothing for a null point, which ends a stroke.
std::vector<std::optional<Point>> points_of(const Json& series) {
    std::vector<std::optional<Point>> points;
    for (const Json& point : series.at("points"))
        if (point.is_array() && point[0].is_number() && point[1].is_number())
            points.push_back(Point{point[0].get<double>(), point[1].get<double>()});
        else
            points.emplace_back();
    return points;
}

std::string text_svg(double x, double y, const char* anchor, const std::string& text, const char* more = "") {
    return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\"{}>{}</text>\n", x, y, anchor, more,
                       surface::xml_escape(text));
}

std::string axes_svg(const Axis& x, const Axis& y, const Json& chart) {
    std::string svg;
    const auto line = [&](double x1, double y1, double x2, double y2) {
        svg += fmt::format("<path d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}\" stroke=\"#d4d4d4\"/>\n", x1, y1, x2, y2);
    };
    for (const double v : x.ticks()) {
        line(x.at(v), y.from, x.at(v), y.to);
        svg += text_svg(x.at(v), y.from + 15.0, "middle", fmt::format("{:.4g}", v));
    }
    for (const double v : y.ticks()) {
        line(x.from, y.at(v), x.to, y.at(v));
        svg += text_svg(x.from - 6.0, y.at(v) + 4.0, "end", fmt::format("{:.4g}", v));
    }
    const double middle = (y.from + y.to) / 2.0;
    svg += text_svg((x.from + x.to) / 2.0, y.from + 34.0, "middle", chart.at("x").get<std::string>());
    return svg + text_svg(13.0, middle, "middle", chart.at("y").get<std::string>(),
                          fmt::format(" transform=\"rotate(-90 13 {:.1f})\"", middle).c_str());
}

std::string series_svg(const Json& series, std::size_t number, const Axis& x, const Axis& y) {
    const char* colour = kColours[std::min<std::size_t>(number, std::size(kColours) - 1)];
    const bool marked = series.value("marked", false);
    std::string path, marks;
    bool pen = false;
    for (const auto& point : points_of(series)) {
        if (point) {
            path += fmt::format("{}{:.1f} {:.1f}", pen ? 'L' : 'M', x.at((*point)[0]), y.at((*point)[1]));
            if (marked || series.value("dots", false))
                marks += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.6\" fill=\"{}\"/>\n",
                                     x.at((*point)[0]), y.at((*point)[1]), colour);
        }
        pen = point.has_value();
    }
    std::string svg;
    if (!series.value("dots", false))
        svg = fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\"{}/>\n", path, colour,
                          number > 1 ? " stroke-dasharray=\"3 3\"" : " stroke-width=\"1.5\"");
    return svg + marks;
}

}  // namespace

Json chart_of_profile(const Contour& ours, const MeasuredProfile& reference, const std::string& length_unit) {
    Eigen::AlignedBox2d box = bounds_of(reference.points);
    const Eigen::Vector2d margin = Eigen::Vector2d::Constant(0.1 * box.diagonal().norm());
    box = Eigen::AlignedBox2d(box.min() - margin, box.max() + margin);
    const auto number = [](double value) { return number_or_null(value, 5); };
    Json line = Json::array(), dots = Json::array();
    Eigen::Vector2d end = Eigen::Vector2d::Constant(1e300);
    for (const auto& [a, b] : ours) {
        if (!box.contains(a) || !box.contains(b)) continue;
        if (a != end) {
            line.push_back(nullptr);
            line.push_back({number(a.x()), number(a.y())});
        }
        line.push_back({number(b.x()), number(b.y())});
        end = b;
    }
    for (const Eigen::Vector2d& point : reference.points)
        dots.push_back({number(point.x()), number(point.y())});
    return {
        {"x", fmt::format("x [{}]", length_unit)},
        {"y", fmt::format("z [{}]", length_unit)},
        {"same_scale", true},
        {"series",
         {{{"name", "ours"}, {"points", line}}, {{"name", "reference"}, {"dots", true}, {"points", dots}}}}};
}

Json chart_of_figures(const Json& readings, const std::string& x_axis) {
    const bool over_x =
        std::none_of(readings.begin(), readings.end(), [](const Json& r) { return r["x"].is_null(); });
    Json ours = Json::array(), reference = Json::array(), low = Json::array(), high = Json::array();
    std::set<std::string> units;
    double before = 0.0, row = 0.0;
    for (const Json& one : readings) {
        const double known = one["reference"].get<double>(), bar = one["reference_bar"].get<double>();
        const double x = over_x ? one["x"].get<double>() : ++row;
        const double unit = over_x ? 1.0 : known;    // that the row's values are divided by
        if (over_x && !ours.empty() && x <= before)  // another curve begins: break the line
            for (Json* points : {&ours, &reference, &low, &high}) points->push_back(nullptr);
        before = x;
        units.insert(one["unit"].get<std::string>());
        if (!one["ours"].is_null()) ours.push_back({x, number_or_null(one["ours"].get<double>() / unit, 5)});
        reference.push_back({x, number_or_null(known / unit, 5)});
        low.push_back({x, number_or_null((known - bar) / unit, 5)});
        high.push_back({x, number_or_null((known + bar) / unit, 5)});
    }
    Json chart{
        {"x", over_x ? x_axis : "row of the table"}, {"y", "ours / reference"}, {"series", Json::array()}};
    if (over_x)
        chart["y"] = units.size() != 1       ? "figure"
                     : *units.begin() == "1" ? "figure [1]"
                                             : fmt::format("figure [{}]", *units.begin());
    chart["series"].push_back({{"name", "ours"}, {"marked", true}, {"points", ours}});
    chart["series"].push_back({{"name", "reference"}, {"marked", true}, {"points", reference}});
    if (low != reference) {
        chart["series"].push_back({{"name", "its bar"}, {"points", low}});
        chart["series"].push_back({{"name", "its bar"}, {"points", high}});
    }
    for (const std::size_t axis : {0u, 1u}) {
        double least = 1e300, most = -1e300;
        for (const Json& series : chart["series"])
            for (const auto& point : points_of(series))
                if (point) {
                    least = std::min(least, (*point)[axis]);
                    most = std::max(most, (*point)[axis]);
                }
        if (least > 0.0 && most > kWide * least) chart[axis == 0 ? "log_x" : "log_y"] = true;
    }
    return chart;
}

std::string chart_svg(const Json& chart) {
    std::vector<double> xs, ys;
    for (const Json& series : chart.at("series"))
        for (const auto& point : points_of(series))
            if (point) {
                xs.push_back((*point)[0]);
                ys.push_back((*point)[1]);
            }
    if (xs.empty()) xs = ys = {0.0, 1.0};
    Axis x = axis_over(xs, chart.value("log_x", false)), y = axis_over(ys, chart.value("log_y", false));
    double height = kHeight;
    x.from = kLeft;
    x.to = kWidth - kRight;
    if (chart.value("same_scale", false)) {
        // Both axes have the same scale, which fills the width or the greatest height.
        const double scale =
            std::min((x.to - x.from) / (x.high - x.low), (kMostHeight - kTop - kBottom) / (y.high - y.low));
        x.to = x.from + scale * (x.high - x.low);
        height = kTop + kBottom + scale * (y.high - y.low);
    }
    y.from = height - kBottom;
    y.to = kTop;
    std::string svg = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {:.0f} {:.0f}\" width=\"{:.0f}\" height=\"{:.0f}\" "
        "font-family=\"sans-serif\" font-size=\"11\">\n<title>{}</title>\n"
        "<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n",
        kWidth, height, kWidth, height, surface::xml_escape(chart.at("title").get<std::string>()));
    svg += axes_svg(x, y, chart);
    // The order is reversed, so that ours is drawn over the reference.
    for (std::size_t k = chart["series"].size(); k-- > 0;) {
        svg += series_svg(chart["series"][k], k, x, y);
        if (k > 2) continue;  // the two bar lines share a name
        const double at = kTop + 14.0 + 16.0 * static_cast<double>(k);
        svg += fmt::format("<path d=\"M{0:.1f} {1:.1f}h18\" stroke=\"{2}\" stroke-width=\"2\"{3}/>\n",
                           x.to + 10.0, at - 4.0, kColours[k], k > 1 ? " stroke-dasharray=\"3 3\"" : "");
        svg += text_svg(x.to + 33.0, at, "start", chart["series"][k]["name"].get<std::string>());
    }
    return svg + "</svg>\n";
}

}  // namespace sidewall::app
