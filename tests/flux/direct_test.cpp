#include "flux/direct.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "flux/open_shares.hpp"
#include "flux/yield.hpp"
#include "surface/ray_scene.hpp"
#include "tests/flux/extracted.hpp"
#include "tests/flux/revolved_mesh.hpp"

using namespace sidewall;
using namespace sidewall::flux;

namespace {

constexpr double kOneDegree = std::numbers::pi / 180.0;

// Parallel ions of energy 100 eV with the yield (1 + 9.3 sin^2) cos.
Species parallel_ions(double tilt_deg = 0.0, double azimuth_deg = 0.0) {
    Species species = ion("ion", {100.0, 0.0}, 1e6);
    const double t = tilt_deg * kOneDegree, a = azimuth_deg * kOneDegree;
    species.beam = {std::sin(t) * std::cos(a), std::sin(t) * std::sin(a), -std::cos(t)};
    species.yields = {{"sputter", Angular::sputter, 25.0, {1.0}, {9.3}}};
    return species;
}

std::vector<double> direct_on(const DirectFlux& direct, const Vec3& normal, double open = 1.0) {
    std::vector<double> flux(direct.tallies(), 0.0);
    const std::vector<double> shares(direct.beams() * direct.tallies(), open);
    direct.add(normal, 0, shares, flux);
    return flux;
}

double sputter(double cosine) {
    return (1.0 + 9.3 * (1.0 - cosine * cosine)) * cosine;
}

}  // namespace

TEST_CASE("what comes straight from parallel ions turns with the normal as their yield says") {
    const DirectFlux direct(parallel_ions());
    REQUIRE(direct.tallies() == 2);
    REQUIRE(direct.beams() == 1);
    const double energetic = std::sqrt(100.0) - std::sqrt(25.0);
    for (double polar = 0.0; polar < 89.0; polar += 7.0) {
        const double c = std::cos(polar * kOneDegree);
        const auto flux = direct_on(direct, {std::sin(polar * kOneDegree), 0.0, c});
        INFO(polar);
        CHECK(flux[0] == Approx(c).margin(2e-3));
        CHECK(flux[1] == Approx(energetic * sputter(c) * c).margin(2e-3 * energetic * 3.0));
    }
    CHECK(direct_on(direct, -Vec3::UnitZ())[0] == 0.0);
    CHECK(direct_on(direct, Vec3::UnitZ(), 0.25)[0] == Approx(0.25));
}

TEST_CASE("a flat wafer gets the mean yield from straight beams, tilted, spread or tabulated") {
    for (const double tilt : {0.0, 30.0, 60.0, 80.0, 85.0})
        for (const double exponent : {100.0, 1000.0}) {
            Species species = parallel_ions(tilt, 20.0);
            species.source_exponent = exponent;
            for (const bool rotating : {false, true}) {
                species.rotating = rotating;
                const auto flux = direct_on(DirectFlux(species), Vec3::UnitZ());
                INFO(tilt << " " << exponent << " " << rotating);
                CHECK(flux[0] == Approx(1.0).epsilon(1e-3));
                CHECK(flux[1] == Approx(mean_yield(species, species.yields[0])).epsilon(1e-3));
            }
        }
    Species tabulated = parallel_ions();
    tabulated.bins = {{0.0, 2.0 * kOneDegree, 60.0, 100.0, 0.7},
                      {2.0 * kOneDegree, 6.0 * kOneDegree, 20.0, 60.0, 1.0}};
    CHECK(direct_on(DirectFlux(tabulated), Vec3::UnitZ())[1] ==
          Approx(mean_yield(tabulated, tabulated.yields[0])).epsilon(1e-3));
}

TEST_CASE("a tilted beam's flux on slopes is that of the projected area, whatever its azimuth") {
    for (const double azimuth : {0.0, 45.0, 200.0}) {
        const Species species = parallel_ions(50.0, azimuth);
        const DirectFlux direct(species);
        for (const Vec3& slope : {Vec3(0.3, 0.1, 1.0), Vec3(-0.5, 0.5, 1.0), Vec3(0.0, -1.0, 0.5)}) {
            const Vec3 normal = slope.normalized();
            const double expected = std::max(0.0, -normal.dot(species.beam)) / std::cos(50.0 * kOneDegree);
            CHECK(direct_on(direct, normal)[0] == Approx(expected).margin(0.02));
        }
    }
}

TEST_CASE("mirrored normals get the same from an untilted source") {
    Species species = parallel_ions();
    species.source_exponent = 200.0;
    const DirectFlux direct(species);
    for (const double polar : {20.0, 70.0, 89.0, 95.0}) {
        const double s = std::sin(polar * kOneDegree), c = std::cos(polar * kOneDegree);
        CHECK(direct_on(direct, {s, 0.0, c}) == direct_on(direct, {-s, 0.0, c}));
    }
}

TEST_CASE("wide sources, neutrals, gas and desorption have no straight flux of a normal alone") {
    CHECK(has_direct_flux(parallel_ions()));
    Species species = parallel_ions();
    species.source_exponent = 5.0;
    CHECK_FALSE(has_direct_flux(species));
    species = parallel_ions();
    species.mean_free_path = 1.0;
    CHECK_FALSE(has_direct_flux(species));
    CHECK_FALSE(has_direct_flux(Species()));
}

TEST_CASE("walls see the half of a beam that is above them, and what lies deep under a roof sees nothing") {
    // A floor from x = 0 to 2, a wall at x = 0 facing it, and a roof at height 1 over x > 1 facing down.
    TriangleMesh mesh;
    const auto quad = [&](const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
        const auto n = static_cast<std::uint32_t>(mesh.vertices.size());
        for (const Vec3& p : {a, b, c, d}) mesh.vertices.push_back(p);
        mesh.triangles.push_back({n, n + 1, n + 2});
        mesh.triangles.push_back({n, n + 2, n + 3});
    };
    quad({0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0});
    quad({1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0});
    quad({0, 0, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1});  // normal +x
    quad({1, 0, 1}, {1, 1, 1}, {3, 1, 1}, {3, 0, 1});  // normal -z
    const surface::RayScene scene(mesh);
    LateralBox box;
    box.min = {0.0, 0.0}, box.max = {3.0, 1.0};
    box.boundary = {Boundary::open, Boundary::open};
    const Wedges wedges = make_wedges(mesh);
    Species species = parallel_ions();
    species.source_exponent = 1000.0;
    const auto open = open_shares(DirectFlux(species), mesh, scene, box, wedges);
    REQUIRE(open.size() == 2);  // of arrivals and of the yield
    const auto least_of = [&](std::uint32_t triangle) {
        double least = 1.0;
        for (std::size_t k = 0; k < 3; ++k) least = std::min(least, open[0][wedges.corner[3 * triangle + k]]);
        return least;
    };
    CHECK(least_of(4) == 1.0);  // all of the half that it faces
    CHECK(open[0][wedges.corner[0]] == 1.0);
    for (const std::uint32_t corner : {3u, 4u, 5u})  // of the roofed floor, away from the roof's edge
        if (mesh.vertices[mesh.triangles[2][corner - 3]].x() == 2.0)
            CHECK(open[0][wedges.corner[6 + corner - 3]] == 0.0);
    CHECK(open[0][wedges.corner[3 * 6]] == 0.0);  // the roof's underside
}

TEST_CASE("the middle of a deep hole's floor sees as much of a narrow source as its mouth lets through") {
    // A prism of 96 sides and radius 0.5 under a source cos^n. In a round hole of depth L the middle of the
    // floor sees 1 - (L / sqrt(L^2 + 1/4))^(n + 1) of it.
    for (const auto& [exponent, depth] :
         std::vector<std::pair<double, double>>{{100.0, 2.0}, {500.0, 10.0}, {500.0, 20.0}, {1000.0, 20.0}}) {
        constexpr std::uint32_t kSides = 96;
        TriangleMesh mesh;
        mesh.vertices.push_back({0.0, 0.0, -depth});
        for (const auto& [radius, z] : {std::pair(0.05, -depth), {0.5, -depth}, {0.5, 0.0}})
            for (std::uint32_t k = 0; k < kSides; ++k) {
                const double angle = 2.0 * std::numbers::pi * k / kSides;
                mesh.vertices.push_back({radius * std::cos(angle), radius * std::sin(angle), z});
            }
        for (std::uint32_t k = 0; k < kSides; ++k) {
            const std::uint32_t a = 1 + k, b = 1 + (k + 1) % kSides;
            mesh.triangles.push_back({0, a, b});
            for (const std::uint32_t ring : {0u, kSides}) {  // the wall faces the axis
                mesh.triangles.push_back({a + ring, a + ring + kSides, b + ring});
                mesh.triangles.push_back({b + ring, a + ring + kSides, b + ring + kSides});
            }
        }
        const surface::RayScene scene(mesh);
        LateralBox box;
        box.min = {-0.5, -0.5}, box.max = {0.5, 0.5};
        box.boundary = {Boundary::open, Boundary::open};
        const Wedges wedges = make_wedges(mesh);
        Species species = parallel_ions();
        species.source_exponent = exponent;
        const auto open = open_shares(DirectFlux(species), mesh, scene, box, wedges);
        const double exact = 1.0 - std::pow(depth / std::hypot(depth, 0.5), exponent + 1.0);
        INFO(exponent << " " << depth);
        CHECK(open[0][wedges.corner[0]] == Approx(exact).margin(1.0 / 16.0));  // one of 16 polar angles
    }
}

namespace {

// Share of a source cos^n that reaches the floor of a hole of radius 1: for every polar angle, the overlap of
// the floor with the mouth projected onto it.
double share_of_disc(double exponent, double depth) {
    constexpr int kAngles = 1000;
    double share = 0.0;
    for (int n = 0; n < kAngles; ++n) {
        const double cosine = std::pow((n + 0.5) / kAngles, 1.0 / (exponent + 1.0)),
                     half = 0.5 * depth * std::sqrt(1.0 - cosine * cosine) / cosine;
        if (half < 1.0)
            share +=
                2.0 / std::numbers::pi * (std::acos(half) - half * std::sqrt(1.0 - half * half)) / kAngles;
    }
    return share;
}

// Mean share on the floor at z = -depth.
double share_on_floor(const TriangleMesh& mesh, const Wedges& wedges, const std::vector<double>& open,
                      double depth) {
    double received = 0.0, floor = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Vec3 area = area_vector(mesh, t);
        if (triangle_centroid(mesh, t).z() > -0.999 * depth || area.z() < 0.9 * area.norm()) continue;
        floor += area.z();
        for (std::size_t k = 0; k < 3; ++k) received += area.z() / 3.0 * open[wedges.corner[3 * t + k]];
    }
    return received / floor;
}

}  // namespace

TEST_CASE("the floor of a round hole receives what a narrow source sends there, whatever its half shadow") {
    // Facets are 0.1 of the radius long, penumbras about as wide.
    for (const double depth : {2.0, 3.0, 6.0}) {
        Species species = parallel_ions();
        species.source_exponent = 1000.0;
        const DirectFlux direct(species);
        const double exact = share_of_disc(species.source_exponent, depth);
        INFO(depth);

        const Revolved hole({{0.0, -depth}, {1.0, -depth}, {1.0, 0.0}, {1.5, 0.0}}, 0.1);
        const auto round = open_shares(direct, hole.mesh, hole.scene, hole.box, hole.wedges)[0];
        CHECK(share_on_floor(hole.mesh, hole.wedges, round, depth) == Approx(exact).epsilon(4e-3));

        const TriangleMesh mesh = extracted_hole(depth, 10);
        const surface::RayScene scene(mesh);
        const LateralBox box = lateral_box(mesh, {Boundary::reflective, Boundary::reflective});
        const Wedges wedges = make_wedges(mesh);
        const auto in_space = open_shares(direct, mesh, scene, box, wedges)[0];
        CHECK(share_on_floor(mesh, wedges, in_space, depth) == Approx(exact).epsilon(4e-3));
    }
}

TEST_CASE("the floor of a profile's trench receives what a narrow source sends there, alike on both sides") {
    // A strip one cell of 0.1 wide, from the top on the left over walls at x = -1 and 1 to that on the right.
    constexpr double kCell = 0.1;
    for (const int depth : {1, 2, 4}) {
        std::vector<std::pair<double, double>> points{{-1.5, 0.0}};
        for (int n = 0; n < 10 * depth; ++n) points.emplace_back(-1.0, -kCell * n);
        for (int n = 0; n < 20; ++n) points.emplace_back(-1.0 + kCell * n, -depth);
        for (int n = 10 * depth; n >= 0; --n) points.emplace_back(1.0, -kCell * n);
        points.emplace_back(1.5, 0.0);
        TriangleMesh mesh;
        for (const auto& [x, z] : points)
            for (const double y : {0.0, kCell}) mesh.vertices.push_back({x, y, z});
        for (std::uint32_t n = 0; n + 3 < mesh.vertices.size(); n += 2) {
            mesh.triangles.push_back({n, n + 2, n + 1});
            mesh.triangles.push_back({n + 1, n + 2, n + 3});
        }
        const surface::RayScene scene(mesh);
        const LateralBox box = lateral_box(mesh, {Boundary::reflective, Boundary::periodic});
        const Wedges wedges = make_wedges(mesh);
        Species species = parallel_ions();
        species.source_exponent = 1000.0;
        const std::vector<double> open = open_shares(DirectFlux(species), mesh, scene, box, wedges)[0];
        // Slopes in x of cos^n are nearly normal, of variance v = 1 / (n + 2). Of a penumbra much narrower
        // than the floor the mean over the floor loses sqrt(2 v / pi) depth / width on both sides together.
        INFO(depth);
        CHECK(share_on_floor(mesh, wedges, open, depth) ==
              Approx(1.0 - std::sqrt(2.0 / 1002.0 / std::numbers::pi) * depth / 2.0).epsilon(4e-3));
        double left = 0.0, right = 0.0;
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
            if (const Vec3 middle = triangle_centroid(mesh, t); middle.z() < -0.999 * depth)
                for (std::size_t k = 0; k < 3; ++k)
                    (middle.x() < 0.0 ? left : right) += open[wedges.corner[3 * t + k]];
        CHECK(left == Approx(right).epsilon(1e-3));
    }
}

namespace {

// Adds a quadrilateral with its own four vertices.
void add_quad(TriangleMesh& mesh, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    const auto n = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const Vec3& p : {a, b, c, d}) mesh.vertices.push_back(p);
    mesh.triangles.push_back({n, n + 1, n + 2});
    mesh.triangles.push_back({n, n + 2, n + 3});
}

// Share of a source seen from the middle of the floor of an endless slit, 1 wide and 10 deep. Half way down a
// \p strip 0.2 wide may hang.
double share_of_floor(const Species& species, bool strip, std::size_t tally = 0) {
    TriangleMesh mesh;
    const double end = 20.0;
    add_quad(mesh, {-0.01, -0.01, -10}, {0.01, -0.01, -10}, {0.01, 0.01, -10}, {-0.01, 0.01, -10});
    add_quad(mesh, {-0.5, -end, -10}, {-0.5, end, -10}, {-0.5, end, 0}, {-0.5, -end, 0});
    add_quad(mesh, {0.5, end, -10}, {0.5, -end, -10}, {0.5, -end, 0}, {0.5, end, 0});
    if (strip) add_quad(mesh, {-0.1, -end, -5}, {-0.1, end, -5}, {0.1, end, -5}, {0.1, -end, -5});
    const surface::RayScene scene(mesh);
    LateralBox box;
    box.min = {-0.5, -end}, box.max = {0.5, end};
    box.boundary = {Boundary::open, Boundary::open};
    const Wedges wedges = make_wedges(mesh);
    return open_shares(DirectFlux(species), mesh, scene, box, wedges)[tally][wedges.corner[0]];
}

}  // namespace

TEST_CASE("a floor under a thin strip sees the source on both sides of it") {
    Species species = parallel_ions();
    species.source_exponent = 500.0;
    // Slopes in x of cos^n are nearly normal, of variance 1 / (n + 2): those seen are 0.1 / 5 to 0.5 / 10.
    const auto within = [](double slope) { return std::erf(slope * std::sqrt(502.0 / 2.0)); };
    // There are 32 directions up to mirroring; each edge may put one on the wrong side and one beside it.
    CHECK(share_of_floor(species, true) == Approx(within(0.05) - within(0.02)).margin(2.0 / 32.0));
    CHECK(share_of_floor(species, false) == Approx(within(0.05)).margin(2.0 / 32.0));
}

TEST_CASE("directions of a tabulated source count by the weights of their bins") {
    Species species = parallel_ions();
    species.bins = {{0.0, 0.2 * kOneDegree, 100.0, 100.0, 0.99},
                    {6.0 * kOneDegree, 6.5 * kOneDegree, 100.0, 100.0, 1.0}};
    CHECK(share_of_floor(species, false) >= 0.989);
}

TEST_CASE("a tabulated source of many bins is seen by their weights, in whatever order they stand") {
    // Of 40 energies with 30 angles each: the angle's density is the same for all.
    Species species = parallel_ions();
    double sum = 0.0;
    for (int energy = 0; energy < 40; ++energy)
        for (int k = 0; k < 30; ++k) {
            const double from = 0.25 * k * kOneDegree;
            sum += std::exp(-0.5 * std::pow((0.25 * k + 0.125) / 1.5, 2.0)) / 40.0;
            species.bins.push_back({from, from + 0.25 * kOneDegree, 50.0 + energy, 51.0 + energy, sum});
        }
    for (SourceBin& bin : species.bins) bin.until /= sum;
    // Shares within an angle a of slope up to 0.05, of uniform azimuth, by the midpoint rule.
    double seen = 0.0;
    for (int k = 0; k < 30; ++k) {
        const double angle = (0.25 * k + 0.125) * kOneDegree, slope = std::tan(angle),
                     weight = std::exp(-0.5 * std::pow((0.25 * k + 0.125) / 1.5, 2.0)) / sum;
        seen += weight * (slope <= 0.05 ? 1.0 : 2.0 / kPi * std::asin(0.05 / slope));
    }
    // 32 directions up to mirroring; each edge may put one on the wrong side and one beside it.
    CHECK(share_of_floor(species, false) == Approx(seen).margin(2.0 / 32.0));
}

TEST_CASE("a floor that sees one of two populations of ions has that one's yield") {
    // Half of the ions are narrow and below the threshold, half are wide and above it: on the floor arrive
    // the former, which remove nothing.
    Species species = parallel_ions();
    species.bins = {{0.0, 0.2 * kOneDegree, 4.0, 8.0, 0.5},
                    {6.0 * kOneDegree, 6.5 * kOneDegree, 100.0, 100.0, 1.0}};
    // Of slopes tan 6.25 degrees in all azimuths those up to 0.05 in x pass. There are 16 directions of each
    // population up to mirroring; each edge may put one on the wrong side and one beside it.
    const double passes = 2.0 / kPi * std::asin(0.05 / std::tan(6.25 * kOneDegree));
    CHECK(share_of_floor(species, false, 0) == Approx(0.5 * (1.0 + passes)).margin(2.0 / 32.0));
    CHECK(share_of_floor(species, false, 1) == Approx(passes).margin(2.0 / 16.0));
    std::swap(species.bins[0].energy_from, species.bins[1].energy_from);
    std::swap(species.bins[0].energy_to, species.bins[1].energy_to);
    species.bins[0].energy_from = species.bins[0].energy_to;
    CHECK(share_of_floor(species, false, 1) >= 0.999);
}

TEST_CASE("deep walls see the steep part of a source, which arrives there at grazing incidence") {
    // A wall 20 below the top of another one at a distance of 1 sees slopes s up to a = 0.05. They are nearly
    // normal, of variance v = 1 / (n + 2), and arrivals are proportional to s, so that their share is
    // 1 - exp(-a^2 / 2v). A yield cos(incidence) adds a factor s: erf(x) - 2 x exp(-x^2) / sqrt(pi), x^2 =
    // a^2 / 2v.
    TriangleMesh mesh;
    const double end = 20.0;
    add_quad(mesh, {0, -0.01, -20}, {0, 0.01, -20}, {0, 0.01, -19.99}, {0, -0.01, -19.99});
    add_quad(mesh, {1, end, -25}, {1, -end, -25}, {1, -end, 0}, {1, end, 0});
    const surface::RayScene scene(mesh);
    LateralBox box;
    box.min = {0.0, -end}, box.max = {1.0, end};
    box.boundary = {Boundary::open, Boundary::open};
    const Wedges wedges = make_wedges(mesh);
    Species species = parallel_ions();
    species.source_exponent = 500.0;
    species.yields = {{"cos", Angular::cosine, 25.0}};
    const auto open = open_shares(DirectFlux(species), mesh, scene, box, wedges);
    const double x = 0.05 * std::sqrt(502.0 / 2.0);
    CHECK(open[0][wedges.corner[0]] == Approx(1.0 - std::exp(-x * x)).margin(2.0 / 32.0));
    CHECK(open[1][wedges.corner[0]] ==
          Approx(std::erf(x) - 2.0 * x * std::exp(-x * x) / std::sqrt(kPi)).margin(2.0 / 32.0));
}
