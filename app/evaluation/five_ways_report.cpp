#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/common/json.hpp"
#include "app/common/text.hpp"
#include "app/evaluation/five_ways.hpp"
#include "app/pictures/svg_plot.hpp"

namespace sidewall::app {
namespace {

constexpr double kNoticeableFactor = 1.1;  // times scatter by as much

std::string full_name(const Json& way) {
    const auto variant = way["variant"].get<std::string>();
    return way["way"].get<std::string>() + (variant.empty() ? "" : fmt::format(" ({})", variant));
}

std::vector<const Json*> best_ways(const Json& entry) {
    std::vector<const Json*> best;
    for (const Json& way : entry["ways"])
        if (way["best"].get<bool>()) best.push_back(&way);
    return best;
}

bool is_simplified(const Json& way) {
    return way["way"].get<std::string>().starts_with("simplified");
}

std::string seconds_text(const Json& seconds, double bias) {
    return seconds.is_null() ? fmt::format("not reached ({:.2g} %)", 100.0 * bias)
                             : fmt::format("{:.3g}", seconds.get<double>());
}

double worst_of(const Json& list, const char* key) {
    double worst = 0.0;
    for (const Json& one : list) worst = std::max(worst, std::abs(one[key].get<double>()));
    return worst;
}

// The fastest of the ways at every depth, of those with or without simplification; or nullptr.
const Json* fastest(const Json& entry, bool simplified) {
    const Json* fastest = nullptr;
    for (const Json* way : best_ways(entry))
        if (is_simplified(*way) == simplified && !(*way)["seconds"].is_null() &&
            (fastest == nullptr || (*way)["seconds"] < (*fastest)["seconds"]))
            fastest = way;
    return fastest;
}

std::string table_line(const std::vector<std::string>& cells) {
    return fmt::format("| {} |\n", fmt::join(cells, " | "));
}

}  // namespace

std::string five_ways_verdicts(const Json& study) {
    std::string rows;
    const auto told = [](const Json* way) {
        return way == nullptr ? std::string("none gets there")
                              : fmt::format("{}: {:.3g} s", full_name(*way), (*way)["seconds"].get<double>());
    };
    for (const Json& surface : study["surfaces"])
        for (const Json& entry : surface.value("five_ways", Json::array())) {
            const Json *raw = fastest(entry, false), *simplified = fastest(entry, true);
            std::string verdict = raw == nullptr && simplified != nullptr ? "yes" : "no";
            if (raw != nullptr && simplified != nullptr) {
                const double ratio = (*raw)["seconds"].get<double>() / (*simplified)["seconds"].get<double>();
                const double factor = std::max(ratio, 1.0 / ratio);
                verdict = factor < kNoticeableFactor ? "even"
                          : ratio > 1.0              ? fmt::format("yes: {:.2g} times as fast", factor)
                                                     : fmt::format("no: {:.2g} times as slow", factor);
            }
            rows += table_line({std::to_string(surface["surface"].get<int>()),
                                fmt::format("{:.3g}", entry["sticking"].get<double>()), told(raw),
                                told(simplified), verdict});
        }
    if (rows.empty()) return "";
    const double target = study["flux_error_target"].get<double>();
    return fmt::format("CPU seconds end to end to {:.3g} % flux error at every depth:\n\n", 100.0 * target) +
           table_line({"surface", "sticking", "fastest on the raw mesh", "fastest on a simplified one",
                       "simplification pays"}) +
           table_line(std::vector<std::string>(5, "---")) + rows + "\n";
}

std::string five_ways_report(const Json& entry) {
    const auto ways = best_ways(entry);
    std::vector<std::string> head{"depth", "flux", "scatter of the reference"}, every{"every depth", "", ""};
    double resolved = 0.0;
    for (const Json* way : ways) {
        resolved = std::max(resolved, worst_of((*way)["by_depth"], "bias_resolved"));
        head.push_back(full_name(*way));
        every.push_back(seconds_text((*way)["seconds"], worst_of((*way)["by_depth"], "bias")));
    }
    std::string text = fmt::format(
        "### Five ways to {:.3g} % at every depth, sticking {:.3g}\n\nCPU seconds end to end, from the raw mesh on: "
        "features, simplification, hierarchy, tracing or gathering rows, solving with its errors, averaging. Relative "
        "L2 error at the raw surface's vertices, by tenths of the depth from the top and on the floor. "
        "Times are scaled by the squared noise; in brackets what a way is off by however many rays it has. The reference is "
        "radiosity on the raw mesh, repeated with other rays. Its scatter at single vertices is taken off all squares; "
        "biases below {:.2g} % may be what that leaves. Fluxes of raw top-down, which is unbiased, differ from it by at "
        "most {:.2g} % in the mean of a depth, their own noise included.\n\n",
        100.0 * entry["target"].get<double>(), entry["sticking"].get<double>(), 100.0 * resolved,
        100.0 * worst_of(entry["depths"], "shift"));
    text += table_line(head) + table_line(std::vector<std::string>(head.size(), "---"));
    for (std::size_t d = 0; d < entry["depths"].size(); ++d) {
        const Json& depth = entry["depths"][d];
        std::vector<std::string> cells{
            depth["name"], fmt::format("{:.3g}", depth["flux"].get<double>()),
            fmt::format("{:.2g} %", 100.0 * depth["reference_error"].get<double>())};
        for (const Json* way : ways) {
            const Json& at = (*way)["by_depth"][d];
            cells.push_back(seconds_text(at["seconds"], at["bias"].get<double>()));
        }
        text += table_line(cells);
    }
    text += table_line(every) + "\nEvery variant, at every depth:\n\n" +
            table_line({"way", "CPU seconds", "largest bias"}) + table_line({"---", "---", "---"});
    for (const Json& way : entry["ways"]) {
        const double bias = worst_of(way["by_depth"], "bias");
        text += table_line(
            {full_name(way), seconds_text(way["seconds"], bias), fmt::format("{:.2g} %", 100.0 * bias)});
    }
    return text + "\n";
}

std::string five_ways_csv(const Json& study) {
    std::string text =
        "surface,sticking,way,variant,best,depth,flux,reference_error,bias,noise,rays,seconds\n";
    for (const Json& surface : study["surfaces"])
        for (const Json& entry : surface.value("five_ways", Json::array()))
            for (const Json& way : entry["ways"])
                for (std::size_t d = 0; d < entry["depths"].size(); ++d) {
                    const Json &depth = entry["depths"][d], &at = way["by_depth"][d];
                    text += fmt::format(
                        "{},{},{},{},{},{},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{}\n",
                        surface["surface"].get<int>(), entry["sticking"].get<double>(),
                        csv_field(way["way"].get<std::string>()),
                        csv_field(way["variant"].get<std::string>()), way["best"].get<bool>() ? 1 : 0,
                        depth["name"].get<std::string>(), depth["flux"].get<double>(),
                        depth["reference_error"].get<double>(), at["bias"].get<double>(),
                        at["noise"].get<double>(), at["rays"].get<double>(),
                        at["seconds"].is_null() ? "" : fmt::format("{:.9g}", at["seconds"].get<double>()));
                }
    return text;
}

std::vector<std::pair<std::string, std::string>> five_ways_figures(const Json& surface) {
    std::vector<std::pair<std::string, std::string>> figures;
    const int n = surface["surface"].get<int>();
    for (const Json& entry : surface.value("five_ways", Json::array())) {
        const double sticking = entry["sticking"].get<double>();
        Plot plot{fmt::format("Surface {}: time to {:.3g} % flux error, sticking {:.3g}", n,
                              100.0 * entry["target"].get<double>(), sticking),
                  "depth [%], floor at 105",
                  "CPU seconds end to end",
                  {},
                  false,
                  true};
        for (const Json* way : best_ways(entry)) {
            PlotSeries series{(*way)["way"], {}, false, true};
            for (std::size_t d = 0; d < entry["depths"].size(); ++d) {
                const Json &depth = entry["depths"][d], &seconds = (*way)["by_depth"][d]["seconds"];
                const double x = depth["name"] == "floor"
                                     ? 105.0
                                     : std::atof(depth["name"].get<std::string>().c_str()) + 5.0;
                series.points.emplace_back(x, seconds.is_null() ? 0.0 : seconds.get<double>());
            }
            plot.series.push_back(std::move(series));
        }
        figures.emplace_back(fmt::format("surface{}_five_ways_{:.3g}.svg", n, sticking), svg_plot(plot));
    }
    return figures;
}

}  // namespace sidewall::app
