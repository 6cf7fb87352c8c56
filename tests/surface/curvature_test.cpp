#include "surface/curvature.hpp"

#include <catch2/catch.hpp>

#include "surface/error.hpp"
#include "surface_meshes.hpp"

using namespace sidewall;
using namespace sidewall::surface;

namespace {

double largest(const std::vector<double>& values, const std::function<double(std::size_t)>& exact) {
    double error = 0.0;
    for (std::size_t i = 0; i < values.size(); ++i) error = std::max(error, std::abs(values[i] - exact(i)));
    return error;
}

/// A bump over [0, 1]^2 whose slope vanishes on all four sides, so that mirror images continue it smoothly.
TriangleMesh mirror_bump(std::uint32_t n) {
    return test::grid_mesh(n, n, [](double u, double v) {
        return Vec3(u, v, 0.2 * std::cos(std::numbers::pi * u) * std::cos(2 * std::numbers::pi * v));
    });
}

}  // namespace

TEST_CASE("a flat surface has exactly no curvature, whatever its triangles and tilt") {
    TriangleMesh mesh = test::plane_mesh(12);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> shift(-0.03, 0.03);
    for (Vec3& p : mesh.vertices)
        if (std::abs(p.x()) < 1.0 && std::abs(p.y()) < 1.0) p += Vec3(shift(random), shift(random), 0.0);
    SECTION("level") {}
    SECTION("tilted") {
        for (Vec3& p : mesh.vertices) p = Vec3(p.x(), 0.8 * p.y(), 0.6 * p.y() + 5.0);
        // The sides y = +-0.8 stay in place, so that the boundary still ends in them.
    }
    // The tilted plane meets its mirror image at y = +-0.8 in an edge: only the inner vertices are flat
    // there.
    const Curvature curvature = mesh_curvature(mesh);
    const Box3 box = bounding_box(mesh);
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        const bool edge = box.size().z() > 0.0 &&
                          (mesh.vertices[i].y() == box.min.y() || mesh.vertices[i].y() == box.max.y());
        if (edge) continue;
        REQUIRE(curvature.mean[i] == 0.0);
        REQUIRE(curvature.gaussian[i] == 0.0);
    }
}

TEST_CASE("mean curvature of a torus converges with the square of the edge length") {
    const double major = 1.0, minor = 0.4;
    double last_mean = 0.0, last_gaussian = 0.0;
    for (const std::uint32_t n : {48u, 96u, 192u}) {
        const TriangleMesh mesh = test::torus_mesh(n, major, minor);
        const Curvature curvature = mesh_curvature(mesh);
        const auto outward = [&](std::size_t i) {
            const double r = std::hypot(mesh.vertices[i].x(), mesh.vertices[i].y());
            return (r - major) / minor;  // cosine of the poloidal angle
        };
        const double mean = largest(curvature.mean, [&](std::size_t i) {
            return (major + 2 * minor * outward(i)) / (2 * minor * (major + minor * outward(i)));
        });
        const double gaussian = largest(curvature.gaussian, [&](std::size_t i) {
            return outward(i) / (minor * (major + minor * outward(i)));
        });
        UNSCOPED_INFO("n " << n << " mean " << mean << " gaussian " << gaussian);
        if (last_mean > 0.0) {
            CHECK(last_mean / mean > 3.5);
            CHECK(last_gaussian / gaussian > 3.5);
        }
        last_mean = mean;
        last_gaussian = gaussian;
    }
    CHECK(last_mean < 0.01);
}

TEST_CASE("a sphere has mean curvature 1/r and, on average, gaussian 1/r^2") {
    const double radius = 2.0;
    double last = 0.0;
    for (const int level : {2, 3, 4}) {
        const TriangleMesh mesh = test::sphere_mesh(level, radius);
        const Curvature curvature = mesh_curvature(mesh);
        const double error = largest(curvature.mean, [&](std::size_t) { return 1.0 / radius; });
        UNSCOPED_INFO("level " << level << " error " << error);
        if (last > 0.0) CHECK(last / error > 3.0);
        last = error;
        double average = 0.0;
        for (const double k : curvature.gaussian) average += k / double(curvature.gaussian.size());
        CHECK(average == Approx(0.25).epsilon(0.02));
    }
    // With its triangles reversed the sphere bounds a concave material.
    TriangleMesh hollow = test::sphere_mesh(3, radius);
    for (Triangle& t : hollow.triangles) std::swap(t[0], t[1]);
    CHECK(mesh_curvature(hollow).mean[0] == Approx(-0.5).epsilon(0.01));
}

TEST_CASE("a cylinder that ends on side planes is curved alike up to its ends, and not gaussian at all") {
    const double radius = 0.5;
    const TriangleMesh mesh = test::grid_mesh(
        64, 10,
        [=](double u, double v) {
            const double a = 2 * std::numbers::pi * u;
            return Vec3(3 * v - 1, radius * std::cos(a), radius * std::sin(a));
        },
        true, false);
    const Curvature curvature = mesh_curvature(mesh);
    const double h = 2 * std::numbers::pi / 64;
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        REQUIRE(curvature.gaussian[i] == 0.0);
        REQUIRE(curvature.mean[i] == Approx(1.0 / (2 * radius)).epsilon(h * h));
        REQUIRE(curvature.mean[i] == Approx(curvature.mean[0]).epsilon(1e-11));
    }
}

TEST_CASE("a vertex on a side plane has the curvature that the mirrored surface has there") {
    const std::uint32_t n = 16;
    const TriangleMesh quarter = mirror_bump(n);
    // The bump mirrored about x = 0 and y = 0: mirrored triangles reversed, vertices joined by position.
    TriangleMesh full;
    std::map<std::array<double, 3>, std::uint32_t> known;
    for (const double sx : {1.0, -1.0})
        for (const double sy : {1.0, -1.0})
            for (const Triangle& t : quarter.triangles) {
                Triangle image;
                for (std::size_t k = 0; k < 3; ++k) {
                    const Vec3 p = quarter.vertices[t[k]].cwiseProduct(Vec3(sx, sy, 1.0)) + Vec3::Zero();
                    const auto [it, fresh] =
                        known.try_emplace({p.x(), p.y(), p.z()}, std::uint32_t(full.vertices.size()));
                    if (fresh) full.vertices.push_back(p);
                    image[k] = it->second;
                }
                if (sx * sy < 0.0) std::swap(image[0], image[1]);
                full.triangles.push_back(image);
            }
    REQUIRE(full.vertices.size() == (2 * n + 1) * (2 * n + 1));
    const Curvature one = mesh_curvature(quarter), all = mesh_curvature(full);
    for (std::size_t i = 0; i < quarter.vertices.size(); ++i) {
        const Vec3& p = quarter.vertices[i];
        const std::uint32_t j = known.at({p.x(), p.y(), p.z()});
        REQUIRE(one.mean[i] == Approx(all.mean[j]).epsilon(1e-10).margin(1e-10));
        REQUIRE(one.gaussian[i] == Approx(all.gaussian[j]).epsilon(1e-10).margin(1e-10));
    }
}

TEST_CASE("a boundary elsewhere takes the curvature of its inner neighbours") {
    TriangleMesh cap = test::sphere_mesh(4, 1.0);
    std::erase_if(cap.triangles, [&](const Triangle& t) {
        return std::any_of(t.begin(), t.end(),
                           [&](std::uint32_t v) { return cap.vertices[v].dot(Vec3(1, 1, 1)) < 0.6; });
    });
    const Curvature curvature = mesh_curvature(cap);
    std::vector<std::uint8_t> used(cap.vertices.size(), 0);
    for (const Triangle& t : cap.triangles)
        for (const std::uint32_t v : t) used[v] = 1;
    for (std::size_t i = 0; i < used.size(); ++i) {
        if (used[i]) REQUIRE(curvature.mean[i] == Approx(1.0).epsilon(0.02));
        if (!used[i]) REQUIRE(curvature.mean[i] == 0.0);
    }
}

TEST_CASE("features are where curvature exceeds the bound set by the spacing") {
    const TriangleMesh sphere = test::sphere_mesh(4, 1.0);
    const auto count = [](const std::vector<std::uint8_t>& flags) {
        return std::count(flags.begin(), flags.end(), 1);
    };
    // Vertices of a mean curvature above C / spacing are flagged; here it is 1, and no bound is close to 1.
    CHECK(count(feature_flags(sphere, 0.1)) == 0);
    CHECK(count(feature_flags(sphere, 1.0)) == std::ptrdiff_t(sphere.vertices.size()));
    CHECK(count(feature_flags(sphere, 0.1, 0.05)) == std::ptrdiff_t(sphere.vertices.size()));
    // A saddle with zero mean curvature is flagged for its Gaussian curvature.
    CHECK(feature_flags(Curvature{{0.0, 0.0}, {-30.0, -20.0}}, 0.1) == std::vector<std::uint8_t>{1, 0});
    CHECK(feature_flags(Curvature{{-5.1, 4.9}, {0.0, 0.0}}, 0.1) == std::vector<std::uint8_t>{1, 0});
    CHECK_THROWS_AS(feature_flags(sphere, 0.0), GeometryError);
    CHECK_THROWS_AS(feature_flags(sphere, std::nan("")), GeometryError);
    CHECK_THROWS_AS(feature_flags(sphere, 0.1, -1.0), GeometryError);
}

TEST_CASE("degenerate and repeated triangles give no NaN") {
    TriangleMesh mesh = test::sphere_mesh(1, 1.0);
    mesh.triangles.push_back({0, 0, 1});
    mesh.triangles.push_back({2, 2, 2});
    mesh.triangles.push_back(mesh.triangles[0]);
    mesh.vertices.emplace_back(9, 9, 9);
    const Curvature curvature = mesh_curvature(mesh);
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        REQUIRE(std::isfinite(curvature.mean[i]));
        REQUIRE(std::isfinite(curvature.gaussian[i]));
    }
}

TEST_CASE("the automatic feature parameter finds rounded corners, but neither roughness nor curved walls") {
    // Mean curvatures, per grid spacing, of walls and of some corners: 1 / (2 * 4) at a radius of 4 spacings.
    const auto parameter = [](double wall, double corner, std::size_t corners) {
        std::vector<double> mean(1000, wall), gaussian(1000, 0.0);
        for (std::size_t i = 0; i < corners; ++i) mean[i] = corner;
        return surface::auto_feature_parameter(mean, gaussian, 1.0);
    };
    CHECK(parameter(0.001, 0.125, 100) == Approx(0.125));
    CHECK(parameter(0.001, 0.9, 100) == 0.5);
    CHECK(parameter(0.0, 0.0, 0) == 0.02);
    CHECK(parameter(0.0625, 0.0625, 0) == Approx(3 * 0.0625));
    CHECK(surface::auto_feature_parameter({}, {}, 1.0) == 0.5);
}
