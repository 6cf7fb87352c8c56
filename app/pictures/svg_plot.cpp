#include "app/pictures/svg_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace sidewall::app {
namespace {

constexpr double kWidth = 720.0, kHeight = 440.0, kLeft = 80.0, kRight = 220.0, kTop = 40.0, kBottom = 60.0;
constexpr double kToLegend = 40.0, kLetter = 7.0;  // a letter's width, at most in the mean of a name
// Okabe and Ito's palette, safe for colour-blind readers; lines whose colour comes again are dashed.
constexpr std::array kColours{"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000"};
constexpr std::array kDashes{"", "8 4", "2 3", "10 3 2 3"};

std::string escaped(const std::string& text) {
    std::string out;
    for (const char c : text)
        out += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : std::string(1, c);
    return out;
}

// Maps values of one axis to pixels.
struct Axis {
    double low = std::numeric_limits<double>::infinity(), high = -low, from = 0.0, to = 1.0;
    bool log = false;

    bool shows(double value) const { return std::isfinite(value) && (!log || value > 0.0); }
    double scale(double value) const { return log ? std::log10(value) : value; }
    void include(double value) {
        if (!shows(value)) return;
        low = std::min(low, scale(value));
        high = std::max(high, scale(value));
    }
    // Rounds the range outwards to whole ticks.
    double settle() {
        if (log) {
            low = std::floor(low);
            high = std::max(std::ceil(high), low + 1.0);
            return 1.0;
        }
        low = std::min(low, 0.0);
        if (high <= low) high = low + 1.0;
        const double rough = (high - low) / 6.0, power = std::pow(10.0, std::floor(std::log10(rough)));
        const double step = power * (rough / power < 1.5   ? 1.0
                                     : rough / power < 3.5 ? 2.0
                                     : rough / power < 7.5 ? 5.0
                                                           : 10.0);
        low = step * std::floor(low / step);
        high = step * std::ceil(high / step - 1e-9);
        return step;
    }
    double pixel(double value) const { return from + (scale(value) - low) / (high - low) * (to - from); }
    double scale_of() const { return std::abs(to - from) / (high - low); }  // pixels a unit
    double value(double scaled) const { return log ? std::pow(10.0, scaled) : scaled; }
};

std::string series_svg(const PlotSeries& series, const Axis& x, const Axis& y, const char* colour,
                       const std::string& dash) {
    constexpr std::size_t kFew = 20;  // points that each get a dot
    std::vector<std::string> lines(1);
    std::string dots;
    for (const auto& [at, value] : series.points) {
        if (!x.shows(at) || !y.shows(value)) {
            if (series.broken && !lines.back().empty()) lines.emplace_back();
            continue;
        }
        const double px = x.pixel(at), py = y.pixel(value);
        lines.back() += fmt::format("{:.1f},{:.1f} ", px, py);
        if (series.dots || series.points.size() <= kFew)
            dots +=
                fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\" fill=\"{}\"/>\n", px, py, colour);
    }
    std::string svg;
    for (const std::string& line : lines)
        if (!series.dots)
            svg +=
                fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.8\"{}/>\n",
                            line, colour, dash);
    return svg + dots;
}

}  // namespace

std::string svg_plot(const Plot& plot) {
    Axis x{.from = kLeft, .to = kWidth - kRight, .log = plot.log_x};
    Axis y{.from = kHeight - kBottom, .to = kTop, .log = plot.log_y};
    for (const PlotSeries& s : plot.series)
        for (const auto& point : s.points)
            if (x.shows(point.first) && y.shows(point.second))
                x.include(point.first), y.include(point.second);
    std::size_t longest = 0;
    for (const PlotSeries& s : plot.series) longest = std::max(longest, s.name.size());
    std::string svg = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" "
        "font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" "
        "fill=\"white\"/>\n"
        "<text x=\"{2}\" y=\"22\" font-size=\"15\">{3}</text>\n",
        std::max(kWidth, kWidth - kRight + kToLegend + kLetter * static_cast<double>(longest)), kHeight,
        kLeft, escaped(plot.title));
    if (!(x.low <= x.high && y.low <= y.high))
        return svg + fmt::format("<text x=\"{}\" y=\"{}\">no data</text>\n</svg>\n", kLeft, kHeight / 2);
    const double x_step = x.settle(), y_step = y.settle();
    if (plot.same_scale) {  // the other axis becomes shorter
        const double scale = std::min(x.scale_of(), y.scale_of());
        x.to = x.from + scale * (x.high - x.low);
        y.to = y.from - scale * (y.high - y.low);
    }
    for (int n = 0; x.low + n * x_step <= x.high + 1e-9 * x_step; ++n) {
        const double value = x.value(x.low + n * x_step), p = x.pixel(value);
        svg += fmt::format(
            "<line x1=\"{0:.1f}\" y1=\"{1}\" x2=\"{0:.1f}\" y2=\"{2}\" stroke=\"#dddddd\"/>\n"
            "<text x=\"{0:.1f}\" y=\"{3}\" text-anchor=\"middle\">{4:.5g}</text>\n",
            p, y.to, y.from, y.from + 18.0, std::abs(value) < 1e-12 ? 0.0 : value);
    }
    for (int n = 0; y.low + n * y_step <= y.high + 1e-9 * y_step; ++n) {
        const double value = y.value(y.low + n * y_step), p = y.pixel(value);
        svg += fmt::format(
            "<line x1=\"{0}\" y1=\"{1:.1f}\" x2=\"{2}\" y2=\"{1:.1f}\" stroke=\"#dddddd\"/>\n"
            "<text x=\"{3}\" y=\"{4:.1f}\" text-anchor=\"end\">{5:.5g}</text>\n",
            x.from, p, x.to, x.from - 6.0, p + 4.0, std::abs(value) < 1e-12 ? 0.0 : value);
    }
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n",
                       0.5 * (kLeft + kWidth - kRight), kHeight - 18.0, escaped(plot.x_label));
    svg +=
        fmt::format("<text transform=\"translate(18,{:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
                    0.5 * (kTop + kHeight - kBottom), escaped(plot.y_label));
    for (std::size_t s = 0; s < plot.series.size(); ++s) {
        const char* colour = kColours[s % kColours.size()];
        std::string dash = kDashes[s / kColours.size() % kDashes.size()];
        if (!dash.empty()) dash = fmt::format(" stroke-dasharray=\"{}\"", dash);
        svg += series_svg(plot.series[s], x, y, colour, dash);
        const double ly = kTop + 10.0 + 20.0 * static_cast<double>(s), lx = kWidth - kRight + 14.0;
        svg += fmt::format(
            "<line x1=\"{0}\" y1=\"{1}\" x2=\"{2}\" y2=\"{1}\" stroke=\"{3}\" stroke-width=\"3\""
            "{7}/>\n<text x=\"{4}\" y=\"{5}\">{6}</text>\n",
            lx, ly, lx + 20.0, colour, lx + 26.0, ly + 4.0, escaped(plot.series[s].name), dash);
    }
    return svg + "</svg>\n";
}

}  // namespace sidewall::app
