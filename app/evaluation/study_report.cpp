#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include "app/evaluation/five_ways.hpp"
#include "app/evaluation/study.hpp"
#include "app/evaluation/study_values.hpp"

namespace sidewall::app {

using namespace study_values;

namespace {

constexpr double kNoticeable = -0.05;  // smaller changes of a time are within its noise
std::string percent(double share) {
    return std::isfinite(share) ? fmt::format("{:+.0f} %", 100.0 * share) : "-";
}

std::string number(double value) {
    return std::isfinite(value) ? fmt::format("{:.4g}", value) : "-";
}

std::string row_text(const std::vector<std::string>& cells) {
    std::string text = "|";
    for (const std::string& cell : cells) text += " " + cell + " |";
    return text + "\n";
}

std::string head_text(const std::vector<std::string>& cells) {
    return row_text(cells) + row_text(std::vector<std::string>(cells.size(), "---"));
}

std::string table(const Json& surface, const std::vector<std::string>& methods, const RowValue& value) {
    std::vector<std::string> head{"removed"};
    head.insert(head.end(), methods.begin(), methods.end());
    std::string text = head_text(head);
    for (const double removal : removals_of(surface)) {
        std::vector<std::string> cells{fmt::format("{:.0f} %", 100.0 * removal)};
        for (const std::string& method : methods) {
            const Json* row = find_row(surface, method, removal);
            cells.push_back(row ? number(value(*row)) : "-");
        }
        text += row_text(cells);
    }
    return text + "\n";
}

std::vector<std::string> with_features(std::vector<std::string> names) {
    std::erase_if(names, [](const std::string& name) { return !name.starts_with("region"); });
    return names;
}

// One claim: what the chapter says, what each surface shows, and whether it holds on all of them.
std::string claim(const Json& study, const std::string& text, const std::string& chapter,
                  const RowValue& of_surface, const std::function<bool(double)>& holds) {
    std::vector<std::string> cells{text, chapter};
    bool all = true, measured = true;
    for (const Json& surface : study["surfaces"]) {
        const double value = of_surface(surface);
        cells.push_back(percent(value));
        all = all && holds(value);
        measured = measured && std::isfinite(value);
    }
    cells.emplace_back(!measured ? "not measured" : all ? "holds" : "does not hold");
    return row_text(cells);
}

double relative(const Json& surface, const std::string& method, const std::string& to,
                const RowValue& value) {
    return mean_over_sets(surface, method, value) / mean_over_sets(surface, to, value) - 1.0;
}

const char* const kVolume = "lindstrom-turk 0.5/0.5/0";
const char* const kShape = "lindstrom-turk 0.4/0.3/0.3";

std::string verdicts(const Json& study) {
    std::vector<std::string> head{"claim", "chapter"};
    for (const Json& surface : study["surfaces"])
        head.push_back(fmt::format("surface {}", surface["surface"].get<int>()));
    head.emplace_back("verdict");
    std::string text = head_text(head);
    for (const char* region : {"region", "region-bounded"})
        for (const char* base : {kShape, kVolume})
            text += claim(
                study, fmt::format("mean distance to the original, {} against {}", region, base),
                "-20 to -40 %", [&](const Json& s) { return relative(s, region, base, mean_distance); },
                [](double change) { return change <= -0.2; });
    for (const char* region : {"region", "region-bounded"})
        text += claim(
            study, fmt::format("simplification time, features included, {} against {}", region, kVolume),
            "+17 %", [&](const Json& s) { return relative(s, region, kVolume, simplification); },
            [](double change) { return change <= 0.17; });
    for (const char* region : {"region", "region-bounded"})
        text += claim(
            study, fmt::format("tracing time, {} against the raw mesh", region), "-15 %",
            [&](const Json& s) { return mean_over_sets(s, region, trace) / raw_trace_in_turns(s) - 1.0; },
            [](double change) { return change <= -0.15; });
    for (const char* region : {"region", "region-bounded"})
        text += claim(
            study, fmt::format("tracing time, {} against {}", region, kShape), "up to -12 % (deep)",
            [&](const Json& s) { return relative(s, region, kShape, trace); },
            [](double change) { return change <= kNoticeable; });
    if (study["surfaces"].size() == 2) {
        const auto gain = [&](std::size_t n) {
            const Json& s = study["surfaces"][n];
            return 1.0 - mean_over_sets(s, "region", trace) / raw_trace_in_turns(s);
        };
        text += row_text({"deep trenches gain most in tracing (region against raw)", "yes", percent(-gain(0)),
                          percent(-gain(1)), gain(1) > gain(0) - kNoticeable ? "holds" : "does not hold"});
    }
    return text +
           "\nMeans over all sets of vertices removed; negative is less. A claim holds if it does on every "
           "surface.\n\n";
}

std::string depth_table(const Json& surface) {
    std::string text = head_text({"mesh", "slice of height", "flux", "bias", "noise"});
    const auto rows = [&](const std::string& name, const Json& error_json) {
        for (const Json& slice : error_json["by_depth"])
            text += row_text(
                {name, fmt::format("{:.3g} to {:.3g}", at(slice, {"z_low"}), at(slice, {"z_high"})),
                 number(at(slice, {"flux"})), number(at(slice, {"bias"})), number(at(slice, {"noise"}))});
    };
    rows("raw", surface["raw"]["flux_error"]);
    const double most = removals_of(surface).back();
    for (const std::string& method : traced(surface))
        if (const Json* row = find_row(surface, method, most)) rows(method, (*row)["trace"]["flux_error"]);
    return text + "\n";
}

// Rays from which simplifying pays, against tracing the raw mesh.
double break_even(const Json& surface, const Json& row) {
    const double rays = at(row, {"trace", "rays"});
    const double saved = (raw_trace_in_turns(surface) - trace(row)) / rays;
    const double cost = simplification(row) + bvh(row) - raw_bvh(surface);
    return saved > 0.0 ? std::max(0.0, cost / saved) : kUnknown;
}

std::string surface_report(const Json& surface, double target) {
    const auto all = methods_of(surface), some = traced(surface);
    const auto name = [&](const char* figure) {
        return fmt::format("![{0}](surface{1}_{0}.svg)\n\n", figure, surface["surface"].get<int>());
    };
    std::string text = fmt::format(
        "## Surface {}\n\n{} vertices, {} triangles, grid spacing dx = {:.6g} {}, {} feature vertices at C = "
        "0.5, {} at C = {:.3g}, which `auto` chooses.\n\n",
        surface["surface"].get<int>(), surface["vertices"].get<int>(), surface["triangles"].get<int>(),
        surface["grid_spacing"].get<double>(), surface["length_unit"].get<std::string>(),
        surface["features"].get<int>(), surface["features_auto"]["count"].get<int>(),
        surface["features_auto"]["parameter"].get<double>());
    text += "### Distance to the original\n\nMaximum, original to simplified, in dx:\n\n" +
            table(surface, all, max_distance) + "Mean, in dx:\n\n" + table(surface, all, mean_distance) +
            "Maximum, simplified to original, in dx:\n\n" +
            table(surface, all,
                  [](const Json& r) {
                      return at(r, {"simplified_to_original", "max"});
                  }) +
            "Triangles with an angle below 5 degrees:\n\n" +
            table(surface, all,
                  [](const Json& r) {
                      return at(r, {"quality", "slivers"});
                  }) +
            name("distance_mean") + name("distance_max") + name("exceedance");
    text +=
        "### Simplification time\n\nCPU seconds, features and collapse (median; CGAL's methods: one run):\n\n" +
        table(surface, all, simplification) + "Of which features:\n\n" +
        table(surface, with_features(all),
              [](const Json& r) {
                  return at(r, {"seconds", "features"});
              }) +
        name("simplification_time");
    text +=
        fmt::format(
            "### Tracing time\n\nCPU seconds for {:.3g} rays; the raw mesh takes {:.4g} s, and {:.4g} s to "
            "build its hierarchy:\n\n",
            at(surface["raw"], {"rays"}), raw_trace_in_turns(surface), raw_bvh(surface)) +
        table(surface, some, trace) + name("trace_time");
    text += fmt::format(
                "End to end, CPU seconds: features, simplification, hierarchy and tracing; raw: {:.4g}:\n\n",
                raw_trace_in_turns(surface) + raw_bvh(surface)) +
            table(surface, some, end_to_end) + "Rays from which simplifying pays (-: never):\n\n" +
            table(surface, some, [&](const Json& r) { return break_even(surface, r); });
    text += fmt::format(
        "### Time to equal flux error\n\nRelative L2 error of the flux at the raw surface's vertices. Bias "
        "is what more rays do not mend; 0 where it is below what the reference resolves.\n\n");
    text += head_text({"raw mesh", "bias", "noise", fmt::format("rays to {:.3g} %", 100 * target),
                       "CPU seconds end to end"});
    const auto raw_row = [&](const std::string& label, const Json& error_json, double extra) {
        text += row_text({label, number(at(error_json, {"bias"})), number(at(error_json, {"noise"})),
                          number(at(error_json, {"rays_to_error"})),
                          number(raw_bvh(surface) + extra + at(error_json, {"seconds_to_error"}))});
    };
    raw_row("as it is", surface["raw"]["flux_error"], 0.0);
    for (const Json& s : surface["raw"]["smoothed"])
        raw_row(fmt::format("smoothed over neighbours, {} rounds", s["rounds"].get<int>()), s["flux_error"],
                at(s, {"seconds"}));
    text +=
        "\nBias of the simplified meshes:\n\n" + table(surface, some, bias) +
        fmt::format("CPU seconds end to end to {:.3g} % (-: the bias alone exceeds it):\n\n", 100 * target) +
        table(surface, some, to_error) + name("flux_error") + name("time_to_error") +
        "By depth, at the largest removal:\n\n" + depth_table(surface);
    return text;
}

}  // namespace

std::string study_report(const Json& study) {
    const bool hierarchical = std::ranges::any_of(
        study["surfaces"], [](const Json& surface) { return surface["grid"]["levels"].size() > 1; });
    const double target = study["flux_error_target"].get<double>();
    std::string text = fmt::format(
        "# Region simplification on process surfaces\n\nThe evaluation of Lenz (2023), section 8.3, "
        "repeated on surfaces that Sidewall grew. They come from {}, and they carry the roughness of their own "
        "Monte Carlo fluxes. sidewall "
        "{}, {} threads, {:.3g} rays a trace, sticking {:.3g}; distances in grid spacings; methods at equal "
        "numbers of vertices; times are CPU seconds of all threads, methods in turns, simplification a median "
        "of {}.\n\n## Verdicts\n\n",
        hierarchical ? "a grid of several levels, as the chapter's do"
                     : "a uniform grid where the chapter's come from a hierarchical one",
        study["version"].get<std::string>(), study["threads"].get<int>(), study["rays"].get<double>(),
        study["sticking"].get<double>(), study["repeats"].get<int>());
    text += verdicts(study) + five_ways_verdicts(study);
    for (const Json& surface : study["surfaces"]) {
        text += surface_report(surface, target);
        for (const Json& entry : surface.value("five_ways", Json::array())) text += five_ways_report(entry);
    }
    return text;
}

std::string study_csv(const Json& study) {
    const std::vector<std::pair<std::string, RowValue>> columns{
        {"max_distance_dx", max_distance},
        {"mean_distance_dx", mean_distance},
        {"p99_distance_dx",
         [](const Json& r) {
             return at(r, {"original_to_simplified", "p99"});
         }},
        {"back_max_distance_dx",
         [](const Json& r) {
             return at(r, {"simplified_to_original", "max"});
         }},
        {"back_mean_distance_dx",
         [](const Json& r) {
             return at(r, {"simplified_to_original", "mean"});
         }},
        {"slivers",
         [](const Json& r) {
             return at(r, {"quality", "slivers"});
         }},
        {"min_angle_deg",
         [](const Json& r) {
             return at(r, {"quality", "min_angle_deg"});
         }},
        {"features_s",
         [](const Json& r) {
             return at(r, {"seconds", "features"});
         }},
        {"collapse_s", collapse},
        {"bvh_s", bvh},
        {"trace_s", trace},
        {"flux_bias", bias},
        {"flux_noise",
         [](const Json& r) {
             return at(r, {"trace", "flux_error", "noise"});
         }},
        {"rays_to_error", [](const Json& r) {
             return at(r, {"trace", "flux_error", "rays_to_error"});
         }}};
    std::string text = "surface,method,removal,vertices,triangles";
    for (const auto& column : columns) text += "," + column.first;
    text += "\n";
    const auto line = [&](int surface, const std::string& method, double removal, const Json& row) {
        text += fmt::format("{},{},{},{},{}", surface, method, removal, row["vertices"].get<std::size_t>(),
                            row["triangles"].get<std::size_t>());
        for (const auto& [name, value] : columns)
            text += std::isfinite(value(row)) ? fmt::format(",{:.9g}", value(row)) : ",";
        text += "\n";
    };
    for (const Json& surface : study["surfaces"]) {
        if (!surface.contains("rows")) continue;
        Json raw{{"vertices", surface["vertices"]},
                 {"triangles", surface["triangles"]},
                 {"trace", surface["raw"]}};
        line(surface["surface"], "raw", 0.0, raw);
        for (const Json& row : surface["rows"]) line(surface["surface"], row["method"], row["removal"], row);
    }
    return text;
}

}  // namespace sidewall::app
