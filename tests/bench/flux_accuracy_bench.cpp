// CPU seconds of one thread to a flux error of 2 %: on the surface as extracted against simplified meshes,
// simplification and set-up included.
//
//     flux_accuracy_bench [MESH=GRID_SPACING ...]
//
// Without meshes: the study's surfaces. Two errors: `relative_error`, the noise on the traced mesh; and
// relative L2 at the vertices of the extracted surface, which includes the effect of simplification.
#include <tbb/global_control.h>

#include <cmath>
#include <cstdio>
#include <optional>

#include "app/process/arriving/surface_field.hpp"
#include "app/process/arriving/traced_mesh.hpp"
#include "flux/tracer/smoothing.hpp"
#include "simplify/simplify.hpp"
#include "surface/curvature.hpp"
#include "tests/bench/flux_error.hpp"
#include "tests/bench/flux_scene.hpp"

using namespace sidewall;
using bench::Scene;

namespace {

constexpr double kTarget = 0.02;
constexpr std::uint64_t kRays = 4'000'000;

struct Variant {
    const char* name;
    simplify::Options options;
};

std::vector<Variant> variants(const Scene& raw) {
    using simplify::Method;
    const double dx = raw.spacing;
    const auto lindstrom_turk = [&](double kept, simplify::Weights weights) {
        simplify::Options options;
        options.method = Method::lindstrom_turk;
        options.weights = weights;
        options.grid_spacing = dx;
        options.target_vertices =
            static_cast<std::size_t>(kept * static_cast<double>(raw.mesh.vertices.size()));
        return options;
    };
    const auto bounded = [&](Method method, double error) {
        simplify::Options options;
        options.method = method;
        options.grid_spacing = dx;
        options.l_max = 3.0 * dx;
        options.max_error = error * dx;
        return options;
    };
    simplify::Options none;
    none.method = Method::none;
    return {{"extracted", none},
            {"LT .4/.3/.3 90 %", lindstrom_turk(0.1, simplify::kShapeWeights)},
            {"LT .5/.5/0 90 %", lindstrom_turk(0.1, simplify::kVolumeWeights)},
            {"LT .5/.5/0 75 %", lindstrom_turk(0.25, simplify::kVolumeWeights)},
            {"LT 0.02 dx", bounded(Method::lindstrom_turk, 0.02)},
            {"bounded 0.05 dx", bounded(Method::region_bounded, 0.05)},
            {"bounded 0.02 dx", bounded(Method::region_bounded, 0.02)}};
}

TriangleMesh simplified(const Scene& raw, const simplify::Options& options) {
    std::vector<std::uint8_t> features;
    if (options.method == simplify::Method::region_bounded)
        features = surface::feature_flags(raw.mesh, raw.spacing);
    return simplify::simplify(raw.mesh, features, options).mesh;
}

// Edge lengths that the previous time step's flux, traced on the default mesh, allows in this time step.
std::vector<double> lengths_by_flux(const Scene& raw, const simplify::Options& options, double sticking) {
    const Scene before("", simplified(raw, options), raw.spacing);
    const flux::FluxResult result = before.trace(sticking, kRays / 4, 30);
    app::SurfaceFlux arriving;
    arriving.wedges = before.wedges;
    arriving.flux = {flux::smoothed_flux(before.mesh, before.wedges, result.wedge, result.arrivals)};
    arriving.trace.emplace().error = {result.wedge.error};
    const app::SurfaceField field = app::surface_field(before.mesh, before.wedges, {app::kFluxGradient},
                                                       {app::flux_gradient(before.mesh, arriving)});
    constexpr double kChange = 0.1;  // the recipes' default
    return app::resolving_lengths(field, raw.mesh, {}, kChange, raw.spacing);
}

std::string shown(const std::optional<double>& value, const char* format) {
    return value ? fmt::format(fmt::runtime(format), *value) : "none";
}

void measure(const Scene& raw, double sticking) {
    const bench::FluxTruth truth =
        bench::make_truth(raw.mesh, raw.box, 8.0 * static_cast<double>(kRays), sticking);
    std::optional<double> extracted_to_noise, extracted_to_error;
    std::vector<Variant> list = variants(raw);
    const std::vector<double> lengths = lengths_by_flux(raw, list[5].options, sticking);
    list.push_back({"bounded, by flux", list[5].options});
    list.back().options.max_length_at = lengths;
    for (const auto& [name, options] : list) {
        std::optional<Scene> coarse;
        const double begin = bench::cpu_seconds_of([&, &name = name, &options = options] {
            coarse.emplace(name, simplified(raw, options), raw.spacing);
        });
        const double to_noise =
            begin + bench::cpu_seconds_of([&] {
                flux::trace_flux(coarse->mesh, coarse->scene, coarse->box, {"bench", 1.0, {sticking}}, {},
                                 coarse->wedges, {.rays = 1'000'000'000, .relative_error = kTarget});
            });
        const bench::FluxPair pair = bench::trace_pair(coarse->mesh, raw.mesh, raw.box,
                                                       4.0 * static_cast<double>(kRays), sticking, 20);
        const bench::FluxError error = bench::flux_error(pair, truth, kTarget);
        std::optional<double> seconds = error.seconds_to_error, ratio;
        if (seconds) *seconds += begin;
        if (!extracted_to_noise) extracted_to_noise = to_noise, extracted_to_error = seconds;
        if (seconds && extracted_to_error) ratio = *extracted_to_error / *seconds;
        fmt::print("{:<10}{:>9}  {:<18}{:>6.1f}{:>10.2f}{:>8.2f}{:>8.1f}{:>9.4f}{:>9}{:>8}\n", raw.name,
                   sticking, name,
                   100.0 - 100.0 * static_cast<double>(coarse->mesh.vertices.size()) /
                               static_cast<double>(raw.mesh.vertices.size()),
                   begin, to_noise, *extracted_to_noise / to_noise, error.bias, shown(seconds, "{:.2f}"),
                   shown(ratio, "{:.1f}"));
    }
}

}  // namespace

int main(int argc, char** argv) {
    return bench::run_bench("flux_accuracy_bench", [&] {
        const std::vector<Scene> scenes = bench::make_scenes({argv + 1, argv + argc});
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
        fmt::print(
            "\nRemoved: per cent of the vertices. Seconds: to simplify and set up; to a noise of 2 % in "
            "all, and the\nextracted surface's over them; bias: the mesh's part of the error; seconds to an "
            "error of 2 % in all, and the\nextracted surface's over them.\n{:<10}{:>9}  "
            "{:<18}{:>6}{:>10}{:>8}{:>8}{:>9}{:>9}{:>8}\n",
            "surface", "sticking", "mesh", "gone", "simplify", "noise", "ratio", "bias", "error", "ratio");
        for (const Scene& scene : scenes)
            for (const double sticking : {1.0, 0.1}) measure(scene, sticking);
    });
}
