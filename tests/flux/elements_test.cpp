#include <catch2/catch.hpp>
#include <cmath>

#include "flux/radiosity/method_choice.hpp"
#include "tests/flux/cavity.hpp"
#include "tests/flux/flux_meshes.hpp"
#include "tests/flux/truth.hpp"

using namespace sidewall;
using namespace sidewall::flux;

namespace {

constexpr double kTubeDepth = 4.0;
constexpr std::size_t kParts = 8;  // of a triangle's edge, each way

std::vector<double> equal_cuts(std::size_t parts) {
    std::vector<double> cuts;
    for (std::size_t k = 1; k < parts; ++k)
        cuts.push_back(static_cast<double>(k) / static_cast<double>(parts));
    return cuts;
}

// A trench of width 1 with so many elements down each wall, and half as many across its floor.
TriangleMesh coarse_trench(std::size_t cells) {
    return extrude(
        trench_profile(kTubeDepth, 0.5, equal_cuts(cells), equal_cuts(std::max<std::size_t>(1, cells / 2))),
        0.5, std::max<std::size_t>(1, cells / 4));
}

double trench_exact_at(const TrenchFlux& exact, const Vec3& p) {
    if (p.z() > -1e-9) return 1.0;
    return p.z() < -kTubeDepth + 1e-9 ? at_position(exact.floor, p.x() + 0.5)
                                      : at_position(exact.wall, -p.z() / kTubeDepth);
}

// sum(area * rms difference from the exact flux) / sum(area * flux).
double true_element_error(const Cavity& cavity, const std::vector<double>& flux, const TrenchFlux& exact) {
    double error = 0.0, sum = 0.0;
    for (std::size_t t = 0; t < cavity.mesh.triangles.size(); ++t) {
        const auto& corner = cavity.mesh.triangles[t];
        const Vec3 a = cavity.mesh.vertices[corner[0]], b = cavity.mesh.vertices[corner[1]],
                   c = cavity.mesh.vertices[corner[2]];
        double squares = 0.0, mean = 0.0;
        int count = 0;
        for (std::size_t i = 0; i < kParts; ++i)
            for (std::size_t j = 0; i + j < kParts; ++j)
                for (int up = 0; up < (i + j + 1 < kParts ? 2 : 1); ++up) {
                    const double u = (static_cast<double>(i) + (up + 1) / 3.0) / kParts,
                                 v = (static_cast<double>(j) + (up + 1) / 3.0) / kParts;
                    const double value =
                        interpolate(cavity.wedges, flux, static_cast<std::uint32_t>(t), u, v);
                    squares += std::pow(value - trench_exact_at(exact, a + u * (b - a) + v * (c - a)), 2.0);
                    mean += value;
                    ++count;
                }
        const double area = triangle_area(cavity.mesh, t);
        error += area * std::sqrt(squares / count);
        sum += area * mean / count;
    }
    return error / sum;
}

}  // namespace

TEST_CASE("what linear elements are off by falls with the square of their size", "[slow]") {
    // Truth has means over seeds in it, whose noise is far below what elements of a quarter of the depth are
    // off by.
    const auto [sticking, sides] = GENERATE(
        table<double, std::array<Boundary, 2>>({{1.0, kReflective}, {0.2, kReflective}, {0.2, kProfile}}));
    const TrenchFlux exact = trench_flux(kTubeDepth, sticking, 800, 200);
    double coarser = 0.0;
    for (const std::size_t cells : {2, 4}) {
        const Cavity cavity(coarse_trench(cells), sides);
        const std::vector<double> everywhere(cavity.wedges.count(), sticking);
        const DiffuseSpecies species{.sticking = everywhere};
        std::vector<double> mean(cavity.wedges.count(), 0.0);
        constexpr int kSeeds = 4;
        for (int k = 0; k < kSeeds; ++k) {
            Exchange exchange(cavity.mesh, cavity.scene, cavity.box, cavity.wedges, {1.0},
                              {.seed = static_cast<std::uint64_t>(k) + 1});
            gather_for({&species, 1}, exchange, 800'000);
            const RadiosityFlux flux = solve_flux(exchange, species);
            for (std::size_t w = 0; w < mean.size(); ++w) mean[w] += flux.wedge.flux[w] / kSeeds;
        }
        const double off = true_element_error(cavity, mean, exact);
        CAPTURE(sticking, sides == kProfile, cells, off);
        if (cells > 2) CHECK(off < 0.5 * coarser);
        coarser = off;
    }
}

TEST_CASE("a relative error asked for is met") {
    const Cavity cavity(coarse_trench(4), kReflective);
    const std::vector<double> everywhere(cavity.wedges.count(), 1.0);
    const DiffuseSpecies species{.sticking = everywhere};
    for (const double target : {0.035, 0.005}) {
        Exchange exchange(cavity.mesh, cavity.scene, cavity.box, cavity.wedges, {1.0}, {.seed = 1});
        CHECK(solve_fluxes_to({&target, 1}, exchange, {&species, 1}, 10'000'000).front().relative_error <=
              target);
    }
}
