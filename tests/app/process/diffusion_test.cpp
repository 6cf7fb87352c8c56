#include "app/process/arriving/diffusion.hpp"

#include <Eigen/SparseCholesky>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

#include "surface/error.hpp"
#include "tests/surface/surface_meshes.hpp"

// Diffusion along surfaces against closed forms.
using namespace sidewall;
using namespace sidewall::app;

namespace {

constexpr double kPi = std::numbers::pi;

// The plane over [-1, 1]^2, its inner vertices displaced by up to 0.3 cells along each axis.
TriangleMesh uneven_plane(std::uint32_t n) {
    TriangleMesh mesh = test::plane_mesh(n);
    std::mt19937 random(n);
    std::uniform_real_distribution<double> shift(-0.6 / n, 0.6 / n);
    for (Vec3& p : mesh.vertices) {
        const Vec3 push(shift(random), shift(random), 0.0);
        const bool rim = std::abs(p.x()) > 1.0 - 1e-9 || std::abs(p.y()) > 1.0 - 1e-9;
        if (!rim) p += push;
    }
    return mesh;
}

std::vector<double> everywhere(const TriangleMesh& mesh, double value) {
    return std::vector<double>(mesh.triangles.size(), value);
}

// Values of a function at the nodes. Every node is a vertex of weight 1.
template <class F>
std::vector<double> at_nodes(const TriangleMesh& mesh, const DiffusionElements& elements, F&& f) {
    std::vector<double> values(elements.area.size());
    for (std::size_t v = mesh.vertices.size(); v-- > 0;)
        for (std::uint32_t i = elements.first[v]; i < elements.first[v + 1]; ++i)
            if (elements.weight[i] == 1.0) values[elements.node[i]] = f(mesh.vertices[v]);
    return values;
}

std::vector<double> stepped(const DiffusionElements& elements, std::vector<double> values, double time,
                            int steps) {
    const std::vector<double> none(values.size(), 0.0);
    for (int k = 0; k < steps; ++k) values = diffused(elements, values, time / steps, none, none);
    return values;
}

double total(const DiffusionElements& elements, const std::vector<double>& values) {
    return std::inner_product(values.begin(), values.end(), elements.area.begin(), 0.0);
}

double mean_error(const DiffusionElements& elements, const std::vector<double>& got,
                  const std::vector<double>& exact) {
    double error = 0.0, area = 0.0;
    for (std::size_t i = 0; i < got.size(); ++i) {
        error += elements.area[i] * std::abs(got[i] - exact[i]);
        area += elements.area[i];
    }
    return error / area;
}

// Remaining amplitude of `wave` in `got`, by projection.
double left_of(const DiffusionElements& elements, const std::vector<double>& got,
               const std::vector<double>& wave) {
    double up = 0.0, down = 0.0;
    for (std::size_t i = 0; i < got.size(); ++i) {
        up += elements.area[i] * got[i] * wave[i];
        down += elements.area[i] * wave[i] * wave[i];
    }
    return up / down;
}

double obtuse_couplings(const DiffusionElements& elements) {
    double sum = 0.0;
    for (Eigen::Index j = 0; j < elements.stiffness.outerSize(); ++j)
        for (Eigen::SparseMatrix<double>::InnerIterator at(elements.stiffness, j); at; ++at)
            if (at.row() != at.col()) sum += std::max(0.0, at.value());
    return sum;
}

}  // namespace

TEST_CASE("a wave on an uneven plane decays by exp(-D k^2 t): second order in space, first in time") {
    const double d = 0.7, k = kPi, time = 0.1, exact = std::exp(-d * k * k * time);
    const auto wave = [&](const Vec3& p) { return std::cos(k * (p.x() + 1.0)); };
    const auto error = [&](std::uint32_t n, int steps) {
        const TriangleMesh mesh = uneven_plane(n);
        const DiffusionElements elements = diffusion_elements(mesh, everywhere(mesh, d));
        const std::vector<double> before = at_nodes(mesh, elements, wave);
        std::vector<double> expected = before;
        // Expected is the decay by backward Euler, which leaves the error in space alone.
        for (double& value : expected) value *= std::pow(1.0 + d * k * k * time / steps, -steps);
        return mean_error(elements, stepped(elements, before, time, steps), expected);
    };
    const double coarse = error(20, 5), fine = error(40, 5);
    CHECK(coarse < 0.01);
    CHECK(coarse / fine == Approx(4.0).epsilon(0.25));  // second order

    const TriangleMesh mesh = uneven_plane(24);
    const DiffusionElements elements = diffusion_elements(mesh, everywhere(mesh, d));
    const std::vector<double> before = at_nodes(mesh, elements, wave);
    const auto late = [&](int steps) {
        return left_of(elements, stepped(elements, before, time, steps), before) - exact;
    };
    // The error in space is the same for all step counts and cancels in differences.
    const double e5 = late(5), e10 = late(10), e20 = late(20);
    CHECK((e5 - e10) / (e10 - e20) == Approx(2.0).epsilon(0.1));  // first order
    CHECK(std::abs(2.0 * e20 - e10) < 5e-3);                      // extrapolated in time
}

TEST_CASE("a spherical harmonic decays by exp(-l(l + 1) D t/R^2) on a sphere, and its total stays") {
    const double radius = 2.0, d = 0.3, time = 1.0;
    const TriangleMesh mesh = test::sphere_mesh(4, radius);
    const DiffusionElements elements = diffusion_elements(mesh, everywhere(mesh, d));
    const auto check = [&](int l, auto&& harmonic) {
        const std::vector<double> before = at_nodes(mesh, elements, harmonic);
        const int steps = 20;
        const double exact = std::pow(1.0 + l * (l + 1) * d * time / (radius * radius * steps), -steps);
        const std::vector<double> after = stepped(elements, before, time, steps);
        // Edges of the mesh are 0.14 R long: linear elements miss l(l + 1) by the square of that over 12.
        CHECK(left_of(elements, after, before) == Approx(exact).epsilon(2e-3));
        CHECK(total(elements, after) == Approx(total(elements, before)).margin(1e-9));
    };
    check(1, [](const Vec3& p) { return p.z(); });
    check(2, [&](const Vec3& p) { return 3.0 * p.z() * p.z() - radius * radius; });
    check(2, [](const Vec3& p) { return p.x() * p.y(); });
}

TEST_CASE("a source on half a strip spreads to cosh profiles of the diffusion length") {
    const double d = 0.05, decay = 0.8, gain = 0.4, length = std::sqrt(d / decay);
    const TriangleMesh mesh = test::plane_mesh(48);
    const DiffusionElements elements = diffusion_elements(mesh, everywhere(mesh, d));
    std::vector<double> source = at_nodes(mesh, elements, [&](const Vec3& p) {
        return p.x() < -1e-9 ? gain : p.x() > 1e-9 ? 0.0 : 0.5 * gain;
    });
    const std::vector<double> loss(source.size(), decay), zero(source.size(), 0.0);
    // One step of 10^9 lifetimes: the steady state.
    const std::vector<double> steady = diffused(elements, zero, 1e9 / decay, source, loss);
    const std::vector<double> exact = at_nodes(mesh, elements, [&](const Vec3& p) {
        const double c = 0.5 / std::cosh(1.0 / length);
        return gain / decay *
               (p.x() < 0.0 ? 1.0 - c * std::cosh((1.0 + p.x()) / length)
                            : c * std::cosh((1.0 - p.x()) / length));
    });
    // A node's error hardly exceeds (h / length)^2 / 12 = 2.3e-3 of the largest value.
    for (std::size_t i = 0; i < steady.size(); ++i) CHECK(std::abs(steady[i] - exact[i]) < 1.2e-3);
    CHECK(decay * total(elements, steady) == Approx(total(elements, source)).epsilon(1e-8));
}

TEST_CASE("values stay in range and nothing is lost on obtuse triangles, where plain elements undershoot") {
    TriangleMesh mesh = uneven_plane(20);
    for (Vec3& p : mesh.vertices) p.x() += 1.7 * p.y();  // sheared: most triangles are obtuse
    const DiffusionElements elements = diffusion_elements(mesh, everywhere(mesh, 1.0));
    CHECK(obtuse_couplings(elements) > 1.0);
    const std::vector<double> before =
        at_nodes(mesh, elements, [](const Vec3& p) { return p.norm() < 0.3 ? 1.0 : 0.0; });
    for (const double time : {1e-4, 1e-3, 1e-2, 1.0, 1e6}) {
        const std::vector<double> none(before.size(), 0.0),
            after = diffused(elements, before, time, none, none);
        CHECK(*std::min_element(after.begin(), after.end()) >= 0.0);
        CHECK(*std::max_element(after.begin(), after.end()) <= 1.0);
        CHECK(total(elements, after) == Approx(total(elements, before)).epsilon(1e-9));
        if (time > 1e-2) continue;
        Eigen::SparseMatrix<double> matrix = time * elements.stiffness;
        Eigen::VectorXd right(static_cast<Eigen::Index>(before.size()));
        for (Eigen::Index i = 0; i < right.size(); ++i) {
            const auto k = static_cast<std::size_t>(i);
            matrix.coeffRef(i, i) += elements.area[k];
            right[i] = elements.area[k] * before[k];
        }
        const Eigen::VectorXd plain = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(matrix).solve(right);
        CHECK(plain.minCoeff() < -1e-6);  // plain elements undershoot; correcting them changes little
        double apart = 0.0;
        for (Eigen::Index i = 0; i < right.size(); ++i) {
            const auto k = static_cast<std::size_t>(i);
            apart += elements.area[k] * std::abs(plain[i] - after[k]);
        }
        CHECK(apart < 0.05 * total(elements, before));
    }
}

TEST_CASE("periodic sides are one, also where their vertices do not match") {
    const double d = 0.5, k = kPi, time = 0.2;
    TriangleMesh mesh = test::plane_mesh(30);
    // Vertices on the sides at x = -1 and 1 but the corners shift along y, each side by its own wave.
    for (Vec3& p : mesh.vertices)
        if (std::abs(std::abs(p.x()) - 1.0) < 1e-9 && std::abs(p.y()) < 0.99)
            p.y() += 0.01 * std::sin((p.x() > 0.0 ? 5.0 : 3.0) * kPi * p.y());
    const auto wave = [&](const Vec3& p) { return std::sin(k * p.x()); };  // steepest at the sides
    const flux::LateralBox sides{
        {-1.0, -1.0}, {1.0, 1.0}, {flux::Boundary::periodic, flux::Boundary::periodic}};
    const DiffusionElements elements = diffusion_elements(mesh, everywhere(mesh, d), sides);
    CHECK(elements.area.size() == 30 * 30);
    const std::vector<double> before = at_nodes(mesh, elements, wave);
    const int steps = 10;
    const std::vector<double> after = stepped(elements, before, time, steps);
    CHECK(left_of(elements, after, before) ==
          Approx(std::pow(1.0 + d * k * k * time / steps, -steps)).epsilon(0.01));
    CHECK(std::accumulate(elements.area.begin(), elements.area.end(), 0.0) == Approx(4.0).epsilon(1e-12));
    // Through closed sides nothing is exchanged, and the wave decays more slowly.
    const DiffusionElements closed = diffusion_elements(mesh, everywhere(mesh, d));
    const std::vector<double> shut = at_nodes(mesh, closed, wave);
    CHECK(left_of(closed, stepped(closed, shut, time, steps), shut) > 1.1 * left_of(elements, after, before));
}

TEST_CASE("triangles without a coefficient take no part, and a wrong number of coefficients is refused") {
    const TriangleMesh mesh = test::plane_mesh(8);
    std::vector<double> d = everywhere(mesh, 1.0);
    for (std::size_t t = 0; t < d.size(); ++t)
        if (triangle_centroid(mesh, t).x() > 0.0) d[t] = 0.0;
    const DiffusionElements elements = diffusion_elements(mesh, d);
    CHECK(elements.area.size() == 5 * 9);
    CHECK(std::accumulate(elements.area.begin(), elements.area.end(), 0.0) == Approx(2.0).epsilon(1e-12));
    d.pop_back();
    CHECK_THROWS_AS(diffusion_elements(mesh, d), GeometryError);
    const std::vector<double> nothing;
    CHECK(diffused(diffusion_elements(mesh, everywhere(mesh, 0.0)), nothing, 1.0, nothing, nothing).empty());
}
