#include "app/evaluation/study.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <set>
#include <sstream>

#include "app/common/json.hpp"
#include "app/evaluation/study_flux.hpp"
#include "app/pictures/svg_plot.hpp"

using namespace sidewall;
using namespace sidewall::app;

namespace {

// A plane of n x n squares whose true flux is 1 + x / 2, known from two runs of standard deviation 0.01.
struct NoisyFlux {
    TriangleMesh mesh;
    FluxTruth truth;
    std::vector<double> exact;
    std::mt19937 random{7};

    explicit NoisyFlux(std::uint32_t n) {
        for (std::uint32_t j = 0; j <= n; ++j)
            for (std::uint32_t i = 0; i <= n; ++i) mesh.vertices.push_back(Vec3(i, j, 0.001 * j) / n);
        for (std::uint32_t j = 0; j < n; ++j)
            for (std::uint32_t i = 0; i < n; ++i) {
                const std::uint32_t a = j * (n + 1) + i, c = a + n + 1;
                mesh.triangles.push_back({a, a + 1, c + 1});
                mesh.triangles.push_back({a, c + 1, c});
            }
        for (const Vec3& p : mesh.vertices) exact.push_back(1.0 + 0.5 * p.x());
        truth.surface = &mesh;
        truth.vertex_area.assign(mesh.vertices.size(), 1.0);
        truth.flux = noisy(0.0, 0.01);
    }

    FluxPair noisy(double bias, double noise) {
        std::normal_distribution<double> normal(0.0, noise);
        FluxPair pair;
        for (auto* values : {&pair.first, &pair.second})
            for (const double f : exact) values->push_back(f + bias + normal(random));
        pair.rays = 1000.0;
        pair.trace_seconds = 2.0;
        return pair;
    }
    // Root mean square of the true flux.
    double scale() const {
        double sum = 0.0;
        for (const double f : exact) sum += f * f;
        return std::sqrt(sum / static_cast<double>(exact.size()));
    }
};

}  // namespace

TEST_CASE("a flux error is split into bias and noise without mixing them up") {
    NoisyFlux plane(100);
    // One run's standard deviation is 0.2; both together have 0.2 / sqrt(2).
    const Json json = flux_error(plane.noisy(0.05, 0.2), plane.truth, 0.08);
    // 10201 vertices: the product of two errors of 0.2 has a standard error of 0.04 / 101 = 4e-4 beside a
    // squared bias of 2.5e-3, 8 % of the bias at one sigma; the variance is good to sqrt(2) / 101.
    CHECK(json["bias"].get<double>() == Approx(0.05 / plane.scale()).epsilon(0.3));
    CHECK(json["noise"].get<double>() == Approx(0.2 / std::sqrt(2.0) / plane.scale()).epsilon(0.05));
    // rays * noise^2 / (target^2 - bias^2), at 500 rays a second.
    const double rays = json["rays_to_error"].get<double>();
    const double noise = json["noise"].get<double>(), bias = json["bias"].get<double>();
    CHECK(rays == Approx(1000.0 * noise * noise / (0.08 * 0.08 - bias * bias)));
    CHECK(json["seconds_to_error"].get<double>() == Approx(rays * 0.002));
    CHECK(json["by_depth"].size() == 5);
}

TEST_CASE("a bias beyond the target cannot be traced away") {
    NoisyFlux plane(50);
    const Json json = flux_error(plane.noisy(0.2, 0.05), plane.truth, 0.02);
    CHECK(json["rays_to_error"].is_null());
}

TEST_CASE("smoothing over neighbours takes noise down and keeps a linear flux away from the rim") {
    NoisyFlux plane(40);
    FluxPair exact = plane.noisy(0.0, 0.0);
    const FluxPair same = smoothed(exact, plane.mesh, 1);
    const std::size_t middle = 20 * 41 + 20;
    CHECK(same.first[middle] == Approx(exact.first[middle]).epsilon(1e-12));
    const FluxPair rough = plane.noisy(0.0, 0.2);
    const double before = flux_error(rough, plane.truth, 0.02)["noise"].get<double>();
    const double after = flux_error(smoothed(rough, plane.mesh, 4), plane.truth, 0.02)["noise"].get<double>();
    CHECK(after < 0.5 * before);
}

TEST_CASE("a plot shows its points, and says so when it has none") {
    const std::string svg =
        svg_plot({"a < b", "x", "y", {{"line", {{1.0, 10.0}, {2.0, 1000.0}}}}, false, true});
    CHECK(svg.find("a &lt; b") != std::string::npos);
    CHECK(svg.find("<polyline") != std::string::npos);
    CHECK(svg.find("viewBox=\"0 0 720 440\" width=\"720\"") != std::string::npos);
    // A line's name has room beside the plot: from x = 540 on, 7 pixels a letter.
    const std::string wide = svg_plot({"", "x", "y", {{std::string(60, 'm'), {{1.0, 1.0}, {2.0, 2.0}}}}});
    CHECK(wide.find("viewBox=\"0 0 960 440\" width=\"960\"") != std::string::npos);
    CHECK(svg_plot({"none", "x", "y", {{"line", {{1.0, -1.0}}}}, false, true}).find("no data") !=
          std::string::npos);
}

TEST_CASE("lines of a plot that share a colour differ by their dashes, in the legend, too") {
    Plot plot{"many", "x", "y", {}};
    for (int k = 0; k < 28; ++k) plot.series.push_back({std::to_string(k), {{1.0, 1.0 + k}, {2.0, 2.0 + k}}});
    std::istringstream svg(svg_plot(plot));
    std::multiset<std::string> lines, keys;
    for (std::string line; std::getline(svg, line);) {
        const std::size_t stroke = line.find("stroke=");
        if (line.starts_with("<polyline")) lines.insert(line.substr(stroke));
        if (line.starts_with("<line") && line.find("stroke-width=\"3\"") != std::string::npos)
            keys.insert(line.substr(stroke));
    }
    CHECK(lines.size() == 28);
    CHECK(keys.size() == 28);
    CHECK(std::set(lines.begin(), lines.end()).size() == 28);
    CHECK(std::set(keys.begin(), keys.end()).size() == 28);
}
