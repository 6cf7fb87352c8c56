#include "app/evaluation/compare.hpp"

#include <fmt/format.h>

#include "app/common/console.hpp"
#include "app/common/files.hpp"
#include "app/common/json.hpp"
#include "app/process/simulation.hpp"
#include "surface/distance.hpp"

namespace sidewall::app {
namespace {

struct Variant {
    std::string method, folder;
    std::int64_t seed_offset;
};

Json distance_json(const TriangleMesh& surface, const TriangleMesh& raw, double spacing) {
    const surface::TwoSidedDistance d = surface::two_sided_distance(surface, raw);
    return Json{{"hausdorff_max", d.max / spacing}, {"hausdorff_mean", d.mean / spacing}};
}

// Largest relative error of the final surface's fluxes; 0 if there are none.
double flux_error(const Json& summary) {
    double error = 0.0;
    for (const Json& flux : summary["flux"])
        if (flux["relative_error"].is_number()) error = std::max(error, flux["relative_error"].get<double>());
    return error;
}

// Rays of the final surface's fluxes, by which those of different runs compare.
double rays_of(const Json& summary) {
    double rays = 0.0;
    for (const Json& flux : summary["flux"]) rays += flux.value("rays", 0.0);
    return rays;
}

// Share of its rays with which a run of \p error has error \p target: errors fall with the rays' square root.
double rays_at_error(double error, double target) {
    return target > 0.0 ? (error / target) * (error / target) : 1.0;
}

// Seconds for a flux of error \p target. Everything but the tracing costs the same for any number of rays.
double seconds_at_error(const Timing& timing, double error, double target) {
    return timing.features + timing.simplify + timing.bvh + timing.trace * rays_at_error(error, target);
}

}  // namespace

Json compare_methods(const Recipe& recipe, const fs::path& output, bool quiet, bool overwrite) {
    const std::vector<Variant> variants{{"none", "none", 0},     {"lindstrom-turk", "lindstrom-turk", 0},
                                        {"region", "region", 0}, {"region-bounded", "region-bounded", 0},
                                        {"auto", "auto", 0},     {"none", "none-other-seed", 1}};
    Json comparison{{"recipe", recipe.file}, {"variants", Json::array()}};
    RunResult raw;
    for (const Variant& variant : variants) {
        Recipe changed = recipe;
        changed.simplify.method = variant.method;
        changed.flux.seed += variant.seed_offset;
        refuse_link(output / variant.folder);
        const RunResult run = run_recipe(changed, {.output = output / variant.folder,
                                                   .overwrite = overwrite,
                                                   .quiet = quiet,
                                                   .title = variant.folder,
                                                   .warn = print_warning});
        if (variant.folder == "none") {
            raw = run;
            comparison["grid_spacing"] = run.summary["grid_spacing"];
            comparison["length_unit"] = run.summary["length_unit"];
        }
        const Json distances = distance_json(run.surface, raw.surface, raw.summary["grid_spacing"]);
        if (variant.seed_offset != 0) {
            comparison["noise_floor"] = distances;
            continue;
        }
        const double error = flux_error(run.summary);
        comparison["variants"].push_back(Json{
            {"method", variant.method},
            {"timing", run.summary["timing"]},
            {"mesh", run.summary["mesh"]},
            {"final", distances},
            {"relative_error", error},
            {"rays", rays_of(run.summary)},
            {"flux_seconds_at_equal_error", seconds_at_error(run.timing, error, flux_error(raw.summary))},
            {"metrology", run.summary["metrology"]}});
    }
    write_json((output / "compare.json").string(), comparison);
    return comparison;
}

std::string compare_table(const Json& comparison) {
    std::string header = fmt::format("{:<28}", ""), text;
    for (const Json& v : comparison["variants"])
        header += fmt::format("{:>16}", v["method"] == "none" ? "raw" : v["method"]);
    header += fmt::format("{:>16}\n", "noise floor");
    // Adds a row with the value at a JSON pointer in every variant.
    const auto row = [&](const std::string& name, const std::string& pointer, int digits,
                         const Json& floor = "") {
        text += fmt::format("{:<28}", name);
        for (const Json& v : comparison["variants"])
            text += fmt::format("{:>16.{}f}", v.at(Json::json_pointer(pointer)).get<double>(), digits);
        text += fmt::format("{:>16.4f}\n", floor);
    };
    const Json phases = Timing();
    for (const auto& [name, none] : phases.items()) row(name + " [s]", "/timing/" + name, 2);
    row("flux at equal error [s]", "/flux_seconds_at_equal_error", 2);
    row("flux error (statistical)", "/relative_error", 4);
    row("triangles traced", "/mesh/simplified/triangles", 0);
    for (const std::string kind : {"max", "mean"})
        row("distance " + kind + " [dx]", "/final/hausdorff_" + kind, 4,
            comparison["noise_floor"]["hausdorff_" + kind]);
    return header + text + compare_verdict(comparison) + "\n";
}

std::string compare_verdict(const Json& comparison) {
    constexpr double kSame = 1.05;  // ratio of times that a busy machine may change
    const auto number = [](const Json& variant, const char* pointer) {
        return variant.at(Json::json_pointer(pointer)).get<double>();
    };
    const char* at_equal_error = "/flux_seconds_at_equal_error";
    const Json& variants = comparison.at("variants");
    const Json *raw = &variants.at(0), *best = nullptr;
    for (const Json& v : variants)
        if (&v != raw && (best == nullptr || number(v, at_equal_error) < number(*best, at_equal_error)))
            best = &v;
    if (best == nullptr || number(*raw, "/timing/trace") <= 0.0)
        return "No flux was traced, so that simplification had nothing to save.";
    const double before = number(*raw, at_equal_error), after = number(*best, at_equal_error),
                 error = number(*raw, "/relative_error");
    const bool paid = before > kSame * after, lost = after > kSame * before;
    // Where an accuracy is asked for, each run takes the rays that it needs.
    const double own = best->value("rays", 0.0), all = raw->value("rays", 0.0),
                 ratio = own > 0.0 && all > 0.0 ? own / all : 1.0,
                 share = ratio * rays_at_error(number(*best, "/relative_error"), error);
    return fmt::format(
        "Simplification {}: for the flux {} {} takes {:.3g} s and the raw run {:.3g} s{}, because {:.0f} of {:.0f} "
        "triangles are left, which need {:.3g} % of the rays, and simplifying takes {:.2g} s; with {}, as here, the "
        "whole run takes {:.3g} s and the raw one {:.3g} s{}.",
        paid   ? "paid"
        : lost ? "did not pay"
               : "made no difference",
        error > 0.0 ? fmt::format("at an equal error of {:.2g} %", 100.0 * error) : "with equal rays",
        best->at("method").get<std::string>(), after, before,
        paid   ? fmt::format(", {:.1f} times as long", before / after)
        : lost ? fmt::format(", {:.1f} times less", after / before)
               : "",
        number(*best, "/mesh/simplified/triangles"), number(*raw, "/mesh/simplified/triangles"),
        100.0 * share, number(*best, "/timing/features") + number(*best, "/timing/simplify"),
        ratio == 1.0 ? "equal rays" : fmt::format("{:.3g} % of the raw run's rays", 100.0 * ratio),
        number(*best, "/timing/total"), number(*raw, "/timing/total"),
        paid && number(*best, "/timing/total") > number(*raw, "/timing/total")
            ? ": there it gains accuracy, not time"
            : "");
}

}  // namespace sidewall::app
