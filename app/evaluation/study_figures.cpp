#include <fmt/format.h>

#include <cmath>

#include "app/evaluation/five_ways.hpp"
#include "app/evaluation/study.hpp"
#include "app/evaluation/study_values.hpp"
#include "app/pictures/svg_plot.hpp"

namespace sidewall::app {

using namespace study_values;

std::vector<std::pair<std::string, std::string>> study_figures(const Json& study) {
    std::vector<std::pair<std::string, std::string>> figures;
    for (const Json& surface : study["surfaces"]) {
        const int n = surface["surface"].get<int>();
        const auto figure = [&](const char* name, const std::string& title, const std::string& y_label,
                                const std::vector<std::string>& methods, const RowValue& value, bool log_y,
                                double raw) {
            Plot plot{
                fmt::format("Surface {}: {}", n, title), "vertices removed [%]", y_label, {}, false, log_y};
            if (std::isfinite(raw)) plot.series.push_back({"raw mesh", {{20.0, raw}, {90.0, raw}}});
            for (const std::string& method : methods) {
                PlotSeries series{method, {}};
                for (const double removal : removals_of(surface))
                    if (const Json* row = find_row(surface, method, removal))
                        series.points.emplace_back(100.0 * removal, value(*row));
                plot.series.push_back(std::move(series));
            }
            figures.emplace_back(fmt::format("surface{}_{}.svg", n, name), svg_plot(plot));
        };
        const auto all = methods_of(surface), some = traced(surface);
        figure("distance_mean", "mean distance to the original", "distance [dx]", all, mean_distance, true,
               kUnknown);
        figure("distance_max", "largest distance to the original", "distance [dx]", all, max_distance, true,
               kUnknown);
        figure("simplification_time", "simplification time", "CPU seconds", all, simplification, true,
               kUnknown);
        figure("trace_time", "tracing time", "CPU seconds", some, trace, false, raw_trace_in_turns(surface));
        figure("flux_error", "flux error at equal rays", "relative L2 error", some, error, true,
               at(surface["raw"], {"flux_error", "error"}));
        figure("time_to_error", "time to equal flux error", "CPU seconds end to end", some, to_error, true,
               raw_bvh(surface) + at(surface["raw"], {"flux_error", "seconds_to_error"}));
        Plot plot{fmt::format("Surface {}: distances at the largest removal", n),
                  "distance d [dx]",
                  "share of vertices farther than d",
                  {},
                  true,
                  true};
        for (const std::string& method : all)
            if (const Json* row = find_row(surface, method, removals_of(surface).back())) {
                PlotSeries series{method, {}};
                for (const Json& point : (*row)["exceedance"])
                    series.points.emplace_back(point[0].get<double>(), point[1].get<double>());
                plot.series.push_back(std::move(series));
            }
        figures.emplace_back(fmt::format("surface{}_exceedance.svg", n), svg_plot(plot));
        for (auto& figure : five_ways_figures(surface)) figures.push_back(std::move(figure));
    }
    return figures;
}

}  // namespace sidewall::app
