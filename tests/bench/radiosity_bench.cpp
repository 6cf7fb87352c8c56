// CPU seconds of one thread to an rms error of 3 % in every tenth of the depth and on the floor of a round
// hole: radiosity, gathered and solved with its errors, against the tracer on the same mesh.
//
//     radiosity_bench [--exact] [ASPECT:STICKING ...]
//
// Meshes: a quarter of the hole between mirrors, extracted at 10 cells a radius and simplified by
// region-bounded. The tracer's time is scaled by 1 / rms^2 from a run of up to 2e7 rays; where that run's
// error exceeds 10 % the figure is a guess at an order of magnitude. Errors are against radiosity of 2000
// rays an unknown on the same mesh. --exact prints the error of radiosity against the exact flux instead.
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "flux/radiosity/method_choice.hpp"
#include "tests/bench/measure.hpp"
#include "tests/flux/cylinders.hpp"
#include "tests/flux/extracted.hpp"

using namespace sidewall;
using bench::cpu_seconds_of;

namespace {

constexpr double kTarget = 0.03;

struct Hole {
    TriangleMesh mesh;
    surface::RayScene scene;
    flux::LateralBox box;
    flux::Wedges wedges;
    double depth;
    explicit Hole(double aspect)
        : mesh(flux::simplified(flux::extracted_hole(2.0 * aspect, 10), 0.1)),
          scene(mesh),
          box(flux::lateral_box(mesh, {flux::Boundary::reflective, flux::Boundary::reflective})),
          wedges(flux::make_wedges(mesh)),
          depth(2.0 * aspect) {}
    flux::RadiosityFlux solve(double sticking, std::uint64_t rays, std::uint64_t seed,
                              bool errors = true) const {
        flux::Exchange exchange(mesh, scene, box, wedges, {1.0},
                                {.seed = seed, .most_bytes = std::uint64_t{16} << 30});
        const std::vector<double> everywhere(wedges.count(), sticking);
        const flux::DiffuseSpecies species{.sticking = everywhere};
        flux::gather_for({&species, 1}, exchange, rays * wedges.count());
        return flux::solve_flux(exchange, species, {.errors = errors});
    }
    // The largest rms error of the tenths and the floor, and where it is.
    std::pair<double, int> worst(const flux::TallyFlux& flux, const std::vector<double>& truth) const {
        std::pair<double, int> worst{0.0, 0};
        for (int tenth = 0; tenth <= 10; ++tenth)
            worst = std::max(worst, {flux::tenth_rms(mesh, flux.triangle.flux, truth, depth, tenth), tenth});
        return worst;
    }
};

// Cost at the rays an unknown, doubled until the worst rms over three seeds meets the target.
struct Cost {
    std::uint64_t rays = 0;
    double seconds = 0.0, rms = 0.0;
    int tenth = 0;
};

Cost radiosity_cost(const Hole& hole, double sticking, const std::vector<double>& truth) {
    Cost cost;
    for (cost.rays = 16; cost.rays <= 1024; cost.rays *= 2) {
        cost.seconds = cost.rms = 0.0;
        for (std::uint64_t seed = 11; seed <= 13; ++seed) {
            flux::RadiosityFlux flux;
            cost.seconds += cpu_seconds_of([&] { flux = hole.solve(sticking, cost.rays, seed); }) / 3.0;
            const auto [rms, tenth] = hole.worst(flux, truth);
            if (rms > cost.rms) cost.rms = rms, cost.tenth = tenth;
        }
        if (cost.rms <= kTarget) break;
    }
    return cost;
}

Cost tracer_cost(const Hole& hole, double sticking, const std::vector<double>& truth) {
    Cost cost;
    for (cost.rays = 200'000; cost.rays <= 20'000'000; cost.rays *= 10) {
        flux::FluxResult flux;
        cost.seconds = cpu_seconds_of([&] {
            flux = flux::trace_flux(hole.mesh, hole.scene, hole.box, {"bench", 1.0, {sticking}}, {},
                                    hole.wedges, {.rays = cost.rays});
        });
        std::tie(cost.rms, cost.tenth) = hole.worst(flux, truth);
        if (cost.rms <= 0.1 || cost.seconds > 8.0) break;
    }
    return cost;
}

void compare(double aspect, double sticking) {
    const Hole hole(aspect);
    const std::vector<double> truth = hole.solve(sticking, 2000, 1, false).triangle.flux;
    const Cost fast = radiosity_cost(hole, sticking, truth), slow = tracer_cost(hole, sticking, truth);
    const double scaled = slow.seconds * std::pow(std::max(slow.rms, 1e-9) / kTarget, 2.0);
    fmt::print(
        "{:>6}{:>9}{:>9}{:>9}{:>9.3f}{:>8.1f} %{:>4}{:>12.3g}{:>10.3g}{:>9.1f} %{:>4}{:>12.3g}{:>10.0f}x\n",
        aspect, sticking, hole.wedges.count(), fast.rays, fast.seconds, 100.0 * fast.rms, fast.tenth,
        static_cast<double>(slow.rays), slow.seconds, 100.0 * slow.rms, slow.tenth, scaled,
        scaled / fast.seconds);
}

// Prints the deviation from the exact flux in percent, by tenth and on the floor; * for fluxes below 1e-3.
void against_truth() {
    for (const double aspect : {5.0, 10.0, 30.0, 100.0}) {
        const Hole hole(aspect);
        for (const double sticking : {1.0, 0.1, 0.01, 0.001}) {
            const auto flux = hole.solve(sticking, aspect > 50.0 ? 400 : 1000, 1);
            const flux::CylinderTruth truth(hole.depth, sticking);
            fmt::print("{:>6}{:>9}", aspect, sticking);
            for (int tenth = 0; tenth <= 10; ++tenth) {
                const double exact =
                    tenth == 10 ? truth.floor() : truth.wall(-0.1 * (tenth + 0.5) * hole.depth);
                fmt::print(
                    "{:>7.2f}{}",
                    100.0 *
                        (flux::tenth_ratio(hole.mesh, flux.triangle.flux, truth, hole.depth, tenth) - 1.0),
                    exact < 1e-3 ? "*" : " ");
            }
            fmt::print("\n");
        }
    }
}

}  // namespace

int main(int argc, char** argv) {
    std::setvbuf(stdout, nullptr, _IOLBF, 0);
    const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
    if (argc > 1 && std::string(argv[1]) == "--exact") {
        fmt::print(
            "percent off the exact flux by tenth of the depth and on the floor (*: flux below 1e-3)\n");
        against_truth();
        return 0;
    }
    std::vector<std::pair<double, double>> cases{{20, 0.01}, {50, 0.001}, {50, 0.01}, {100, 0.01}};
    if (argc > 1) cases.clear();
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        cases.emplace_back(std::atof(word.c_str()), std::atof(word.substr(word.find(':') + 1).c_str()));
    }
    fmt::print(
        "{:>6}{:>9}{:>9} | radiosity: rays, CPU s, worst rms, where | tracer: rays, CPU s, worst rms, "
        "where, CPU s to 3 % | ratio\n",
        "aspect", "sticking", "unknowns");
    for (const auto& [aspect, sticking] : cases) compare(aspect, sticking);
}
