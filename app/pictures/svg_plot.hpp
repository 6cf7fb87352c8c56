#pragma once
#include <string>
#include <utility>
#include <vector>

namespace sidewall::app {

/// One line of a plot; points that are not finite, or not positive on a logarithmic axis, are left out.
struct PlotSeries {
    std::string name;
    std::vector<std::pair<double, double>> points;
    bool dots = false;    ///< points only, however many
    bool broken = false;  ///< several lines: a point that is left out ends one
};

/// A line plot.
struct Plot {
    std::string title, x_label, y_label;
    std::vector<PlotSeries> series;
    bool log_x = false, log_y = false;
    bool same_scale = false;  ///< of both axes, as for a shape
};

/// The plot as a stand-alone SVG, with axes, ticks and a legend. Empty plots say so.
std::string svg_plot(const Plot& plot);

}  // namespace sidewall::app
