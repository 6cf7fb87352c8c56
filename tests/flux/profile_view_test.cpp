#include "flux/radiosity/profile_view.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "flux/radiosity/radiosity.hpp"
#include "tests/flux/flux_meshes.hpp"
#include "tests/flux/traces.hpp"
#include "tests/flux/trench_table.hpp"

using namespace sidewall;
using namespace sidewall::flux;

namespace {

// The view of a profile's mesh, summed over parts of the profile.
struct Viewed {
    const TriangleMesh& mesh;
    surface::RayScene scene{mesh};
    Wedges wedges = make_wedges(mesh);
    Geometry geometry;
    ProfileUnknowns profile = make_profile_unknowns(geometry, wedges);
    ProfileView view;
    explicit Viewed(const TriangleMesh& mesh_, Boundary side = Boundary::reflective,
                    std::vector<double> exponents = {1.0})
        : mesh(mesh_), geometry(make_geometry(mesh, scene, lateral_box(mesh, {side, Boundary::periodic}))) {
        REQUIRE(can_be_viewed(geometry, profile, exponents));
        view = view_profile(geometry, profile, exponents, {});
        CHECK(view.leaked == 0);
    }
    // 1 for the unknowns of triangles whose centroid is chosen, else 0. Parts must end at creases.
    Eigen::VectorXd of(const std::function<bool(const Vec3&)>& where) const {
        Eigen::VectorXd flags = Eigen::VectorXd::Zero(view.exchange.rows());
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
            for (std::size_t k = 0; k < 3 && where(triangle_centroid(mesh, t)); ++k)
                flags[profile.unknowns.corner[3 * t + k]] = 1.0;
        return flags;
    }
    double share(const Eigen::VectorXd& from, const Eigen::VectorXd& to) const {
        return from.dot(view.exchange * to) / area(from);
    }
    double sky(const Eigen::VectorXd& from, const std::vector<double>& sky) const {
        return from.dot(Eigen::Map<const Eigen::VectorXd>(sky.data(), std::ssize(sky))) / area(from);
    }
    double area(const Eigen::VectorXd& part) const {
        const std::vector<double>& areas = profile.unknowns.area;
        return part.dot(Eigen::Map<const Eigen::VectorXd>(areas.data(), std::ssize(areas)));
    }
};

std::vector<double> cuts(int parts) {
    std::vector<double> at;
    for (int i = 1; i < parts; ++i) at.push_back(static_cast<double>(i) / parts);
    return at;
}

// A profile with every segment cut into so many parts.
Profile fine(const Profile& line, int parts) {
    Profile cut{line.front()};
    for (std::size_t i = 0; i + 1 < line.size(); ++i)
        for (int k = 1; k <= parts; ++k)
            cut.emplace_back(line[i].first + k * (line[i + 1].first - line[i].first) / parts,
                             line[i].second + k * (line[i + 1].second - line[i].second) / parts);
    return cut;
}

const auto left = [](const Vec3& p) { return p.x() < -0.5 + 1e-9 && p.z() < -1e-9; };
const auto right = [](const Vec3& p) { return p.x() > 0.5 - 1e-9 && p.z() < -1e-9; };
const auto floor_of = [](double depth) { return [=](const Vec3& p) { return p.z() < -depth + 1e-9; }; };

}  // namespace

// Hottel's crossed strings: the share from a to b is (crossed - uncrossed) / (2 a).
TEST_CASE(
    "faces of a trench see of each other what crossed strings say, better by the cube of the parts or more") {
    const double depth = 2.0, diagonal = std::hypot(1.0, depth);
    for (const int parts : {4, 8, 16}) {
        const TriangleMesh mesh = extrude(trench_profile(depth, 0.5, cuts(parts), cuts(parts)), 0.1);
        const Viewed seen(mesh);
        const auto wall = seen.of(left), other = seen.of(right), bottom = seen.of(floor_of(depth));
        const double errors[] = {seen.share(bottom, wall) - 0.5 * (1.0 + depth - diagonal),
                                 seen.share(wall, other) - (diagonal - 1.0) / depth,
                                 seen.sky(bottom, seen.view.sky) - (diagonal - depth)};
        double worst = 0.0;
        for (const double error : errors) worst = std::max(worst, std::abs(error));
        CAPTURE(parts, errors[0], errors[1], errors[2]);
        CHECK(worst < 1.0 / std::pow(parts, 3.0));
    }
}

TEST_CASE("what hides the sky from the floor of a cavity leaves what crossed strings through its mouth say") {
    // The mouth, between lips with knife edges, is a quarter of the floor wide.
    const Profile profile = fine({{-1.5, 0.0},
                                  {-0.25, 0.0},
                                  {-1.0, -0.5},
                                  {-1.0, -2.0},
                                  {1.0, -2.0},
                                  {1.0, -0.5},
                                  {0.25, 0.0},
                                  {1.5, 0.0}},
                                 8);
    const TriangleMesh mesh = extrude(profile, 0.1);
    const Viewed seen(mesh);
    const auto bottom = seen.of(floor_of(2.0));
    CHECK(seen.sky(bottom, seen.view.sky) ==
          Approx((std::hypot(1.25, 2.0) - std::hypot(0.75, 2.0)) / 2.0).epsilon(2e-3));
    // All that leaves arrives or meets the sky.
    const Eigen::VectorXd all = Eigen::VectorXd::Ones(seen.view.exchange.rows());
    CHECK(seen.share(all, all) + seen.sky(all, seen.view.sky) == Approx(1.0).epsilon(1e-9));
}

TEST_CASE("a trench across a side that mirrors or repeats the profile is seen as one in the middle") {
    const double depth = 1.0, diagonal = std::hypot(0.5, depth);
    const Profile profile =
        fine({{-0.5, 0.0}, {-0.25, 0.0}, {-0.25, depth}, {0.25, depth}, {0.25, 0.0}, {0.5, 0.0}}, 16);
    const TriangleMesh mesh = extrude(profile, 0.1);
    for (const Boundary side : {Boundary::reflective, Boundary::periodic}) {
        const Viewed seen(mesh, side);
        const auto wall = [&](double x) {
            return seen.of([=](const Vec3& p) { return std::abs(p.x() - x) < 1e-9; });
        };
        const auto walls = wall(-0.25) + wall(0.25);
        CHECK(seen.share(walls, walls) == Approx((diagonal - 0.5) / depth).epsilon(1e-3));
        const auto bottom = seen.of([](const Vec3& p) { return p.z() < 1e-9; });
        CHECK(seen.sky(bottom, seen.view.sky) == Approx((diagonal - depth) / 0.5).epsilon(1e-3));
    }
}

TEST_CASE("a slope of 30 degrees gets the cosine of 30 degrees of a source, however narrow") {
    Profile saw{{-1.0, 0.0}};
    for (int i = 0; i < 8; ++i)
        saw.emplace_back(saw.back().first + 0.25, i % 2 == 0 ? 0.25 * std::tan(kPi / 6.0) : 0.0);
    const TriangleMesh mesh = extrude(saw, 0.1);
    const std::vector<double> exponents{1.0, 20.0, 300.0};
    const Viewed seen(mesh, Boundary::reflective, exponents);
    const Eigen::VectorXd all = Eigen::VectorXd::Ones(seen.view.exchange.rows());
    for (std::size_t k = 0; k < exponents.size(); ++k) {
        CAPTURE(exponents[k]);
        // Two-point Gauss quadrature between angles that are a standard deviation of the source apart.
        CHECK(seen.sky(all, seen.view.direct[k]) ==
              Approx(std::cos(kPi / 6.0)).epsilon(k == 0 ? 2e-3 : 1e-4));
    }
}

TEST_CASE("radiosity by a view is exact radiosity in a trench, without an error from rays") {
    const TriangleMesh mesh = extrude(trench_profile(2.0, 0.5, kCuts, kCuts), 0.05);
    const surface::RayScene scene(mesh);
    const Wedges wedges = make_wedges(mesh);
    Exchange exchange(mesh, scene, lateral_box(mesh, {Boundary::reflective, Boundary::periodic}), wedges,
                      {1.0});
    REQUIRE(exchange.is_viewed());
    exchange.gather(1000);
    for (const double sticking : {1.0, 0.1, 0.01}) {
        const std::vector<double> by_wedge(wedges.count(), sticking);
        const RadiosityFlux flux = solve_flux(exchange, {.sticking = by_wedge});
        CHECK(flux.statistical_error == 0.0);
        for (const Row& row : radiosity_rows()) {
            if (row.aspect != 2.0 || row.sticking != sticking || row.position >= 0.0) continue;
            double area = 0.0, sum = 0.0;
            for (const std::size_t t : triangles_of(mesh, row)) {
                area += triangle_area(mesh, t);
                sum += triangle_area(mesh, t) * flux.triangle.flux[t];
            }
            CAPTURE(sticking, row.where, row.flux, sum / area);
            CHECK(sum / area == Approx(row.flux).epsilon(2e-3));
        }
    }
}

TEST_CASE("facets whose two triangles are of two materials are no profile's, and have fluxes all the same") {
    const TriangleMesh mesh = extrude(trench_profile(2.0, 0.5, kCuts, kCuts), 0.05);
    const surface::RayScene scene(mesh);
    std::vector<std::int32_t> materials(mesh.triangles.size(), 0);
    std::fill(materials.begin() + 2 * (std::ssize(materials) / 4) + 1, materials.end(), 1);
    const Wedges wedges = make_wedges(mesh, materials);
    Exchange exchange(mesh, scene, lateral_box(mesh, {Boundary::reflective, Boundary::periodic}), wedges,
                      {1.0});
    CHECK_FALSE(exchange.is_viewed());
    exchange.gather(40'000);
    const std::vector<double> sticking(wedges.count(), 0.1);
    const RadiosityFlux flux = solve_flux(exchange, {.sticking = sticking});
    const Wedges whole = make_wedges(mesh);
    Exchange viewed(mesh, scene, lateral_box(mesh, {Boundary::reflective, Boundary::periodic}), whole, {1.0});
    viewed.gather(1);
    const RadiosityFlux exact = solve_flux(viewed, {.sticking = std::span(sticking).first(whole.count())});
    CHECK(viewed.is_viewed());
    CHECK(exact.absorbed == Approx(flux.absorbed).epsilon(0.01));
}

TEST_CASE(
    "a floor under a plate with slots is seen past many images of either side, and shines through none") {
    // The plate floats 0.2 above the floor. In flat directions the two face each other over many images.
    const auto box = [](double x0, double x1, double z0, double z1) {
        return Profile{{x0, z0}, {x0, z1}, {x1, z1}, {x1, z0}, {x0, z0}};
    };
    TriangleMesh mesh = extrude(fine({{-1.0, 0.0}, {1.0, 0.0}}, 32), 0.1);
    const TriangleMesh plate = extrude(fine(box(-0.6, 0.6, 0.2, 0.3), 24), 0.1);
    const auto offset = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), plate.vertices.begin(), plate.vertices.end());
    for (auto triangle : plate.triangles) {
        for (std::uint32_t& v : triangle)  // the outline ends where it begins
            v = offset + static_cast<std::uint32_t>(std::ranges::find(plate.vertices, plate.vertices[v]) -
                                                    plate.vertices.begin());
        mesh.triangles.push_back(triangle);
    }
    for (const Boundary side : {Boundary::reflective, Boundary::periodic}) {
        const Viewed seen(mesh, side);
        const Species species{"test", 1.0, {0.2}};
        const FluxResult paths = trace(mesh, {side, Boundary::periodic}, species, {.rays = 400'000});
        Exchange exchange(mesh, seen.scene, seen.geometry.box, seen.wedges, {1.0});
        exchange.gather(1);
        const std::vector<double> sticking(seen.wedges.count(), 0.2);
        const RadiosityFlux flux = solve_flux(exchange, {.sticking = sticking});
        double viewed = 0.0, traced = 0.0, error = 0.0;
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
            if (triangle_centroid(mesh, t).z() > 1e-9) continue;
            viewed += triangle_area(mesh, t) * flux.triangle.flux[t];
            traced += triangle_area(mesh, t) * paths.triangle.flux[t];
            error += triangle_area(mesh, t) * paths.triangle.error[t];
        }
        CAPTURE(viewed, traced, error);
        // The triangles' errors add up at most; the rest is for linear elements.
        CHECK(std::abs(viewed - traced) < error + 0.003 * traced);
    }
}
