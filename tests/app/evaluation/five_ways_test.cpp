#include "tests/bench/five_ways/five_ways.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>
#include <random>

#include "app/common/json.hpp"
#include "flux/tracer/tracer.hpp"
#include "flux/wedges.hpp"
#include "surface/ray_scene.hpp"

using namespace sidewall;
using namespace sidewall::app;
using namespace sidewall::bench;

namespace {

// n x n squares spanned by two edges of length 1 from a corner.
void add_sheet(TriangleMesh& mesh, const Vec3& corner, const Vec3& one, const Vec3& other, std::uint32_t n) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (std::uint32_t j = 0; j <= n; ++j)
        for (std::uint32_t i = 0; i <= n; ++i) mesh.vertices.push_back(corner + (i * one + j * other) / n);
    for (std::uint32_t j = 0; j < n; ++j)
        for (std::uint32_t i = 0; i < n; ++i) {
            const std::uint32_t a = first + j * (n + 1) + i, c = a + n + 1;
            mesh.triangles.push_back({a, a + 1, c + 1});
            mesh.triangles.push_back({a, c + 1, c});
        }
}

// A floor at z = 0 and a wall from there up to z = 1, 20 rows of squares.
TriangleMesh floor_and_wall() {
    TriangleMesh mesh;
    add_sheet(mesh, Vec3(0, 0, 0), Vec3::UnitX(), Vec3::UnitY(), 20);
    add_sheet(mesh, Vec3(1, 0, 0), Vec3::UnitZ(), Vec3::UnitY(), 20);
    return mesh;
}

TriangleMesh plane(std::uint32_t n) {
    TriangleMesh mesh;
    add_sheet(mesh, Vec3(0, 0, 0), Vec3::UnitX(), Vec3::UnitY(), n);
    return mesh;
}

// Two repeats of a method whose flux has the given bias and noise, relative to the true flux of 2.
FluxRuns way_of(std::size_t vertices, double bias, double noise) {
    FluxRuns runs;
    for (const double sign : {1.0, -1.0})
        runs.values.emplace_back(vertices, 2.0 * (1.0 + bias + sign * noise));
    runs.limit.assign(2, std::vector<double>(vertices, 2.0 * (1.0 + bias)));
    runs.rays = 1000.0;
    runs.seconds = 5.0;
    runs.fixed_seconds = 0.25;
    return runs;
}

}  // namespace

TEST_CASE("tenths of the depth and the floor share the whole surface") {
    const TriangleMesh mesh = floor_and_wall();
    const auto bins = depth_bins(mesh);
    REQUIRE(bins.size() == 11);
    double area = 0.0;
    std::size_t vertices = 0;
    for (const DepthBin& bin : bins) {
        area += std::accumulate(bin.area.begin(), bin.area.end(), 0.0);
        vertices += bin.vertices.size();
    }
    CHECK(area == Approx(2.0));
    CHECK(vertices == mesh.vertices.size());
    CHECK(bins.front().name == "0 to 10 %");
    CHECK(bins.back().name == "floor");
    CHECK(bins.back().vertices.size() == 21 * 21);
    for (const std::uint32_t v : bins[9].vertices) CHECK(mesh.vertices[v].x() == 1.0);
}

TEST_CASE("the time to an error is that of the rays which noise beside a bias leaves") {
    const TriangleMesh mesh = floor_and_wall();
    const std::vector<std::vector<double>> reference(2, std::vector<double>(mesh.vertices.size(), 2.0));
    const DepthBin bin = depth_bins(mesh).back();
    FluxRuns runs = way_of(mesh.vertices.size(), 0.012, 0.08);
    const DepthError error = depth_error(bin, runs, reference, 0.02);
    CHECK(error.flux == Approx(2.0));
    CHECK(error.bias == Approx(0.012));
    CHECK(error.noise == Approx(0.08));
    CHECK(error.shift == Approx(0.012));
    CHECK(error.reference_error == Approx(0.0).margin(1e-12));
    // 0.02^2 - 0.012^2 = 0.016^2 is left for the noise of 0.08: 25 times the rays.
    CHECK(error.seconds == Approx(0.25 + 25.0 * 5.0));
    CHECK(error.rays == Approx(25'000.0));
    // A method that cannot take fewer rays takes the time of those.
    runs.fewest_rays = 200.0;
    CHECK(depth_error(bin, runs, reference, 0.5).seconds == Approx(0.25 + 1.0));
    // More rays do not reduce a bias.
    CHECK(std::isinf(depth_error(bin, runs, reference, 0.012).seconds));
}

TEST_CASE("the noise of a reference makes neither bias nor noise of what is compared with it") {
    const TriangleMesh mesh = floor_and_wall();
    const std::size_t n = mesh.vertices.size();
    std::mt19937 random(3);
    const auto noisy = [&](double flux, double deviation) {
        std::normal_distribution<double> normal(flux, deviation);
        std::vector<double> values(n);
        for (double& value : values) value = normal(random);
        return values;
    };
    const std::vector<std::vector<double>> reference{noisy(2.0, 0.1), noisy(2.0, 0.1)};
    FluxRuns runs = way_of(n, 0.0, 0.0);
    runs.values = {noisy(2.0, 0.3), noisy(2.0, 0.3)};
    runs.limit = {noisy(2.0, 0.1), noisy(2.0, 0.1)};
    DepthBin all{"all", std::vector<std::uint32_t>(n), std::vector<double>(n, 1.0)};
    std::iota(all.vertices.begin(), all.vertices.end(), 0);
    const DepthError error = depth_error(all, runs, reference, 0.02);
    // With 882 vertices the squared bias is a mean of products of two deviations of 0.1 sqrt(2), known to
    // 0.02 / sqrt(882). Three standard deviations are 0.045^2, relative to a flux of 2. Variances are known
    // to sqrt(2 / 882) and their roots to half of that, 2.4 %: three times this are 7.2 %.
    CHECK(error.bias < 0.0225);
    CHECK(error.noise == Approx(0.15).epsilon(0.072));
    CHECK(error.reference_error == Approx(0.05 / std::sqrt(2.0)).epsilon(0.072));
}

TEST_CASE(
    "on an open plane the error of top-down is what two traces are off by, and a simplified mesh's own time counts") {
    const TriangleMesh surface = plane(12), coarse = plane(6);
    const flux::LateralBox box =
        flux::lateral_box(surface, {flux::Boundary::reflective, flux::Boundary::reflective});
    const std::vector<SimplifiedMesh> meshes{{"raw", surface, 0.0}, {"coarse", coarse, 3.0}};
    FiveWaysOptions options;
    options.rays = 8192.0;
    options.stickings = {0.5};
    options.reference_rays = 1e5;
    const Json entry = five_ways(meshes, box, options)[0];
    const Json& depths = entry["ways"][0]["by_depth"];
    REQUIRE(depths.size() == 1);  // the whole surface is floor
    const double scatter = depths[0]["reference_error"];
    CHECK(scatter < 0.01);
    const double of_mean = 3.0 * scatter / std::sqrt(169.0);  // three sigma of the mean of 169 vertices
    CHECK(std::abs(depths[0]["flux"].get<double>() - 1.0) < of_mean);

    // The true flux is 1, so the error is the deviation of two traces from 1.
    const surface::RayScene scene(surface);
    const flux::Wedges wedges = flux::make_wedges(surface);
    flux::Species neutral;
    neutral.sticking = {0.5};
    double square = 0.0, area = 0.0;
    for (const std::uint64_t seed : {1, 2}) {
        flux::TraceOptions trace;
        trace.rays = 4096;
        trace.seed = seed;
        const auto result = flux::trace_flux(surface, scene, box, neutral, {}, wedges, trace);
        for (std::size_t w = 0; w < wedges.count(); ++w) {
            square += wedges.area[w] * std::pow(result.wedge.flux[w] - 1.0, 2.0);
            area += wedges.area[w];
        }
    }
    const double noise = std::sqrt(square / area), target = entry["target"].get<double>();
    for (const Json& way : entry["ways"]) {
        const Json& at = way["by_depth"][0];
        const double fixed = way["run_seconds"]["fixed"], of_rays = way["run_seconds"]["of_rays"];
        INFO(way.dump(1));
        if (way["way"] == "raw top-down") {
            CHECK(std::abs(at["noise"].get<double>() - noise) < of_mean);
            CHECK(way["seconds"].get<double>() ==
                  Approx(fixed + of_rays * std::pow(at["noise"].get<double>() / target, 2.0)));
        }
        // Every particle arrives: the mean flux is 1 within three sigma of the mean of at least 49 vertices.
        CHECK(std::abs(at["shift"].get<double>()) < 3.0 * at["noise"].get<double>() / std::sqrt(49.0));
        if (way["way"].get<std::string>().starts_with("simplified")) CHECK(fixed >= 3.0);
    }
    const std::string report = five_ways_table("1", Json::array({entry}));
    CHECK(report.find("(coarse)") != std::string::npos);
    CHECK(report.find("not reached") == std::string::npos);
}

TEST_CASE("a way whose bias is beyond the target is not reached, and the table says by how much") {
    const auto way = [](const char* name, const char* variant, double bias, Json seconds) {
        return Json{
            {"way", name}, {"variant", variant}, {"best", true}, {"bias", bias}, {"seconds", seconds}};
    };
    Json entry{{"sticking", 0.1}, {"target", 0.02}};
    entry["ways"] = Json::array({way("raw top-down", "", 0.0, 40.0), way("raw radiosity", "", 0.001, 10.0),
                                 way("raw top-down, smoothed", "1 round", 0.001, 20.0),
                                 way("simplified top-down", "region, 90 %", 0.034, nullptr),
                                 way("simplified radiosity", "region, 90 %", 0.002, 2.5)});
    CHECK(
        five_ways_table("1", Json::array({entry}))
            .find(
                "| 1, 0.1 | 40 | 20 (1 round) | not reached (3.4 %) (region, 90 %) | 10 | 2.5 (region, 90 %) | 4 |") !=
        std::string::npos);
}
