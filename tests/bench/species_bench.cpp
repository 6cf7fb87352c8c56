// One pass for two species that share their paths against a pass for each, in CPU seconds of one thread.
//
//     species_bench [MESH=GRID_SPACING ...]
//
// Without meshes: the study's surfaces.
#include <tbb/global_control.h>

#include <array>
#include <cmath>
#include <cstdio>

#include "tests/bench/flux_scene.hpp"

using namespace sidewall;
using bench::keep_best;
using bench::Scene;

namespace {

constexpr std::uint64_t kRays = 4'000'000;

// Species of one pass with their stickings; `by_wedge` holds those that coverages decide.
struct Together {
    std::string name;
    std::vector<flux::Species> species;
    std::vector<double> by_wedge;
};

Together with_stickings(double a, double b) {
    return {fmt::format("{}, {}", a, b), {{"first", 1.0, {a}}, {"second", 1.0, {b}}}, {}};
}

// SF6/O2 at the default fluxes and stickings, beta (1 - theta), with the coverages nearly settled. Ions come
// as a vertical beam on upward faces, shadowed or not.
Together sulphur_hexafluoride(const Scene& s) {
    constexpr double kEtchant = 4500.0, kOxygen = 800.0, kSigma = 300.0, kBetaSigma = 0.04;
    constexpr double kBetaE = 0.7, kBetaP = 1.0;
    constexpr double kEnhanced = 860.0, kRemoval = 205.0;  // by ions of 100 eV on a plane
    Together pair{"sf6_o2", {{"etchant", 1.0, {kBetaE}}, {"oxygen", 1.0, {kBetaP}}}, {}};
    const std::size_t n = s.wedges.count();
    std::vector<double> up(n, 0.0);  // cosine of the ions' incidence
    for (std::size_t c = 0; c < s.wedges.corner.size(); ++c) {
        const auto [i, j, k] = s.mesh.triangles[c / 3];
        const auto& x = s.mesh.vertices;
        up[s.wedges.corner[c]] = std::max(0.0, (x[j] - x[i]).cross(x[k] - x[i]).normalized().z());
    }
    pair.by_wedge = std::vector<double>(n, kBetaE);
    pair.by_wedge.resize(2 * n, kBetaP);
    for (int k = 0; k < 6; ++k) {
        const auto results =
            flux::trace_fluxes(s.mesh, s.scene, s.box, pair.species, {}, s.wedges,
                               {.rays = kRays / 4, .time_step = 90, .sticking_by_wedge = pair.by_wedge});
        for (std::size_t w = 0; w < n; ++w) {
            // Steady Langmuir coverages of two species that compete for sites.
            const double e = kBetaE * kEtchant * results[0].wedge.flux[w] / (kSigma + kEnhanced * up[w]);
            const double p = kBetaP * kOxygen * results[1].wedge.flux[w] / (kBetaSigma + kRemoval * up[w]);
            const double free = 1.0 / (1.0 + e + p);
            pair.by_wedge[w] = kBetaE * free;
            pair.by_wedge[n + w] = kBetaP * free;
        }
    }
    return pair;
}

// One pass for both species against a pass for each: time and noise at equal rays, time to a noise of 5 %.
void several_species(const Scene& s) {
    constexpr double kTarget = 0.05;
    for (const Together& pair : {with_stickings(1.0, 0.3), with_stickings(0.3, 0.1),
                                 with_stickings(1.0, 0.02), sulphur_hexafluoride(s)}) {
        const std::size_t n = s.wedges.count();
        const auto options = [&](std::uint64_t rays) {
            return flux::TraceOptions{.rays = rays, .sticking_by_wedge = pair.by_wedge};
        };
        const auto alone = [&](std::size_t k, flux::TraceOptions own) {
            own.species_index = static_cast<std::uint32_t>(k);
            if (!pair.by_wedge.empty()) own.sticking_by_wedge = own.sticking_by_wedge.subspan(k * n, n);
            return own;
        };
        std::array<flux::FluxResult, 2> apart, apart_to;
        std::vector<flux::FluxResult> shared, shared_to;
        std::array<double, 2> own{1e9, 1e9}, own_to{1e9, 1e9};
        double one = 1e9, one_to = 1e9;
        flux::TraceOptions to_target = options(1'000'000'000);
        to_target.relative_error = kTarget;
        for (int repeat = 0; repeat < 3; ++repeat) {
            keep_best(one, [&] {
                shared = flux::trace_fluxes(s.mesh, s.scene, s.box, pair.species, {}, s.wedges,
                                            options(kRays / 2));
            });
            for (std::size_t k = 0; k < 2; ++k)
                keep_best(own[k], [&] {
                    apart[k] = flux::trace_flux(s.mesh, s.scene, s.box, pair.species[k], {}, s.wedges,
                                                alone(k, options(kRays / 2)));
                });
        }
        keep_best(one_to, [&] {
            shared_to = flux::trace_fluxes(s.mesh, s.scene, s.box, pair.species, {}, s.wedges, to_target);
        });
        for (std::size_t k = 0; k < 2; ++k)
            keep_best(own_to[k], [&] {
                apart_to[k] = flux::trace_flux(s.mesh, s.scene, s.box, pair.species[k], {}, s.wedges,
                                               alone(k, to_target));
            });
        const auto rate = [](double seconds) { return static_cast<double>(kRays / 2) / seconds * 1e-6; };
        fmt::print("{:<6}{:<10}{:>8.2f}{:>8.2f}{:>8.2f}{:>8.2f}", s.name, pair.name, rate(own[0]),
                   rate(own[1]), rate(one), (own[0] + own[1]) / one);
        for (std::size_t k = 0; k < 2; ++k)
            fmt::print("{:>9.4f}{:>9.4f}", apart[k].relative_error, shared[k].relative_error);
        // Rays to bring a species to the error of its own pass; the species that needs more decides.
        const auto needs = [&](std::size_t k) {
            return std::pow(shared[k].relative_error / apart[k].relative_error, 2.0);
        };
        fmt::print("{:>8.2f}", (own[0] + own[1]) / (one * std::max(needs(0), needs(1))));
        fmt::print("{:>8.2f}{:>8.2f}{:>8.2f}{:>8.2f}\n", own_to[0], own_to[1], one_to,
                   (own_to[0] + own_to[1]) / one_to);
    }
}

}  // namespace

int main(int argc, char** argv) {
    return bench::run_bench("species_bench", [&] {
        const std::vector<Scene> scenes = bench::make_scenes({argv + 1, argv + argc});
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
        fmt::print(
            "\nMillion source rays a second of each alone and of one pass for both, and the ratio of the "
            "CPU seconds;\nnoise of each at those {} rays, alone and in the pass; the ratio at equal noise "
            "of each; CPU seconds to\na noise of 5 % of each alone and of one pass for both, and their "
            "ratio\n{:<6}{:<10}{:>8}{:>8}{:>8}{:>8}{:>9}{:>9}{:>9}{:>9}{:>8}{:>8}{:>8}{:>8}{:>8}\n",
            kRays / 2, "", "stickings", "first", "second", "both", "ratio", "1 alone", "both", "2 alone",
            "both", "equal", "1 to 5%", "2 to 5%", "both", "ratio");
        for (const Scene& scene : scenes) several_species(scene);
    });
}
