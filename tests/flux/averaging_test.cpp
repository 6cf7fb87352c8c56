#include "flux/tracer/smoothing.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "surface/error.hpp"
#include "tests/flux/flux_meshes.hpp"
#include "tests/flux/revolved_mesh.hpp"

using namespace sidewall;
using namespace sidewall::flux;

namespace {

constexpr std::size_t kCells = 40;
constexpr double kExtent = 2.0;

// A flat square of side kExtent from the origin.
const TriangleMesh kSheet = height_field(kCells, kCells, kExtent, kExtent, [](auto, auto) { return 0.0; });

bool within(const Vec3& p, double margin) {
    return std::min(p.x(), p.y()) > margin && std::max(p.x(), p.y()) < kExtent - margin;
}

FluxField average(const TriangleMesh& mesh, const Wedges& wedges, std::array<Boundary, 2> sides,
                  const std::vector<double>& values, double radius,
                  std::span<const std::int32_t> materials = {}, double error = 0.0) {
    const std::vector<double> errors(mesh.triangles.size(), error);
    const Unaveraged flux{values, errors};
    return averaged(mesh, lateral_box(mesh, sides), wedges, materials, {&flux, 1}, radius).front();
}

}  // namespace

TEST_CASE("an average over a disc: constants stay, a parabola rises by a quarter of the radius squared") {
    const Wedges wedges = make_wedges(kSheet);
    constexpr double kRadius = 0.2;
    for (const auto& sides : {kReflective, kPeriodic})
        for (const double v : average(kSheet, wedges, sides, std::vector(wedges.count(), 1.0), kRadius).flux)
            CHECK(v == Approx(1.0));

    std::vector<double> parabola;
    for (const Vec3& p : kSheet.vertices) parabola.push_back(p.x() * p.x());
    const auto mean = average(kSheet, wedges, kReflective, parabola, kRadius).flux;
    for (std::size_t v = 0; v < mean.size(); ++v)
        // Triangles of a quarter of the radius make the disc's rim ragged, by a few per cent.
        if (within(kSheet.vertices[v], kRadius))
            CHECK(mean[v] - parabola[v] == Approx(kRadius * kRadius / 4.0).epsilon(0.1));
}

TEST_CASE("profiles, plain and round, are averaged over the disc that they stand for") {
    // The sheet is a tenth of the radius wide, as a profile of one cell may be.
    constexpr double kRadius = 0.2;
    const TriangleMesh sheet = height_field(200, 1, kExtent, 0.02, [](auto, auto) { return 0.0; });
    const Revolved disc({{0.0, 0.0}, {kExtent, 0.0}}, 0.01);
    for (const bool round : {false, true}) {
        const TriangleMesh& mesh = round ? disc.mesh : sheet;
        const Wedges wedges = round ? disc.wedges : make_wedges(mesh);
        std::vector<double> parabola(wedges.count()), errors(mesh.triangles.size(), 0.0);
        for (std::size_t c = 0; c < wedges.corner.size(); ++c)
            parabola[wedges.corner[c]] = std::pow(mesh.vertices[mesh.triangles[c / 3][c % 3]].x(), 2);
        const LateralBox box =
            round ? disc.box : lateral_box(mesh, {Boundary::reflective, Boundary::periodic});
        const Unaveraged flux{parabola, errors};
        const FluxField mean = averaged(mesh, box, wedges, {}, {&flux, 1}, kRadius).front();
        for (std::size_t c = 0; c < wedges.corner.size(); ++c) {
            const double x = mesh.vertices[mesh.triangles[c / 3][c % 3]].x();
            if (x > kExtent - kRadius || (!round && x < kRadius)) continue;
            const std::uint32_t w = wedges.corner[c];
            CAPTURE(round, x);
            // The mean of x^2 rises by R^2 / 4, that of x^2 + y^2 by R^2 / 2; the rim is ragged as above.
            CHECK(mean.flux[w] - parabola[w] ==
                  Approx(kRadius * kRadius * (round ? 0.5 : 0.25)).epsilon(0.1));
        }
    }
}

TEST_CASE("averages go on beyond the sides, mirrored or from the opposite one") {
    const Wedges wedges = make_wedges(kSheet);
    constexpr double kRadius = 0.3, kWave = 2.0 * kPi / kExtent;
    // The wave continues itself beyond reflective and periodic sides: its mean over any disc is the wave
    // times 2 J1(k R) / (k R).
    std::vector<double> wave;
    for (const Vec3& p : kSheet.vertices) wave.push_back(std::cos(kWave * p.x()) + std::cos(kWave * p.y()));
    const double factor = 2.0 * std::cyl_bessel_j(1.0, kWave * kRadius) / (kWave * kRadius);
    for (const auto& sides : {kReflective, kPeriodic, std::array{Boundary::reflective, Boundary::periodic}}) {
        const auto mean = average(kSheet, wedges, sides, wave, kRadius).flux;
        for (std::size_t v = 0; v < mean.size(); ++v)
            CHECK(mean[v] == Approx(factor * wave[v]).margin(0.02));  // a tenth of what averaging takes off
    }
}

TEST_CASE("what faces away or is of another material does not count") {
    // A slit narrower than the radius: near a wall lie level parts and the opposite wall, which do not count.
    const TriangleMesh slit =
        extrude({{0.0, 0.0}, {0.95, 0.0}, {0.95, -1.0}, {1.05, -1.0}, {1.05, 0.0}, {2.0, 0.0}}, 0.5, 10);
    const Wedges wedges = make_wedges(slit);
    std::vector<double> left(wedges.count(), 0.0);
    const auto is_left = [&](std::size_t c) { return c / 3 >= 20 && c / 3 < 40; };  // the second segment
    for (std::size_t c = 0; c < wedges.corner.size(); ++c)
        if (is_left(c)) left[wedges.corner[c]] = 1.0;
    CHECK(average(slit, wedges, kReflective, left, 0.2).flux == left);

    std::vector<std::int32_t> materials;
    for (std::size_t t = 0; t < kSheet.triangles.size(); ++t)
        materials.push_back(triangle_centroid(kSheet, t).x() > 0.5 * kExtent ? 1 : 0);
    const Wedges split = make_wedges(kSheet, materials);
    std::vector<double> value(split.count());
    for (std::size_t c = 0; c < split.corner.size(); ++c) value[split.corner[c]] = materials[c / 3];
    CHECK(average(kSheet, split, kReflective, value, 0.3, materials).flux == value);
}

TEST_CASE("the error of an average falls with the number of triangles it is taken over") {
    const Wedges wedges = make_wedges(kSheet);
    constexpr double kError = 0.1, kRadius = 0.3;
    const double triangle = 0.5 * std::pow(kExtent / kCells, 2);
    const double expected = kError * std::sqrt(triangle / (kPi * kRadius * kRadius));
    const auto mean =
        average(kSheet, wedges, kPeriodic, std::vector(wedges.count(), 1.0), kRadius, {}, kError);
    for (std::size_t v = 0; v < mean.error.size(); ++v) CHECK(mean.error[v] == Approx(expected).epsilon(0.1));
    CHECK_THROWS_AS(average(kSheet, wedges, kPeriodic, std::vector(wedges.count(), 1.0), 0.0), RecipeError);
}

TEST_CASE("no wedge is left out, wherever the surface is lowest") {
    // A bowl: no vertex lies below the lowest one, none beyond those at the rim.
    const TriangleMesh bowl = height_field(kCells, kCells, kExtent, kExtent, [](auto i, auto j) {
        const auto x = static_cast<double>(i) / kCells - 0.5, y = static_cast<double>(j) / kCells - 0.5;
        return 2.0 * (x * x + y * y);
    });
    const Wedges wedges = make_wedges(bowl);
    for (const double radius : {0.03, 0.1, 0.4}) {
        const auto mean =
            average(bowl, wedges, kReflective, std::vector(wedges.count(), 1.0), radius, {}, 0.1);
        for (std::size_t w = 0; w < wedges.count(); ++w) {
            CHECK(mean.flux[w] == Approx(1.0));
            CHECK(mean.error[w] > 0.0);
        }
    }
}
