#include "tests/flux/flux_checks.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "flux/wedges.hpp"
#include "surface/ray_scene.hpp"

namespace sidewall::flux {

std::vector<std::vector<Mean>> over_seeds(const TriangleMesh& mesh, std::array<Boundary, 2> boundary,
                                          std::span<const Species> species, std::uint64_t rays,
                                          std::uint32_t stream, const Groups& groups,
                                          std::span<const std::int32_t> materials, double roulette) {
    constexpr int kSeeds = 64;
    const surface::RayScene scene(mesh);
    const LateralBox box = lateral_box(mesh, boundary);
    const Wedges wedges = make_wedges(mesh, materials);
    std::vector<std::vector<Mean>> means(species.size(), std::vector<Mean>(groups.size()));
    std::vector<std::vector<double>> squares(species.size(), std::vector<double>(groups.size(), 0.0));
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
        const std::vector<FluxResult> results = trace_fluxes(
            mesh, scene, box, species, materials, wedges,
            {.rays = rays / kSeeds, .seed = seed, .time_step = stream, .batches = 16, .roulette = roulette});
        for (std::size_t k = 0; k < species.size(); ++k) {
            CHECK(results[k].leaked == 0);
            CHECK(results[k].ledger.balanced());
            for (std::size_t g = 0; g < groups.size(); ++g) {
                double sum = 0.0, area = 0.0;
                for (const std::size_t t : groups[g]) {
                    const double a = triangle_area(mesh, t);
                    sum += a * results[k].triangle.flux[t];
                    area += a;
                }
                means[k][g].flux += sum / area / kSeeds;
                squares[k][g] += sum / area * sum / area / kSeeds;
            }
        }
    }
    for (std::size_t k = 0; k < species.size(); ++k)
        for (std::size_t g = 0; g < groups.size(); ++g) {
            Mean& mean = means[k][g];
            mean.error = std::sqrt(std::max(0.0, squares[k][g] - mean.flux * mean.flux) / (kSeeds - 1));
        }
    return means;
}

std::vector<Mean> over_seeds(const TriangleMesh& mesh, std::array<Boundary, 2> boundary,
                             const Species& species, std::uint64_t rays, std::uint32_t stream,
                             const Groups& groups, std::span<const std::int32_t> materials, double roulette) {
    return over_seeds(mesh, boundary, std::span(&species, 1), rays, stream, groups, materials, roulette)
        .front();
}

double mean_over_triangle(const TriangleMesh& mesh, std::size_t t,
                          const std::function<double(const Vec3&)>& f) {
    const auto [i, j, k] = mesh.triangles[t];
    const Vec3 a = mesh.vertices[i], b = mesh.vertices[j] - a, c = mesh.vertices[k] - a;
    constexpr int kParts = 8;
    double sum = 0.0;
    for (int u = 0; u < kParts; ++u)
        for (int v = 0; u + v < kParts; ++v) {
            sum += f(a + (u + 1.0 / 3.0) / kParts * b + (v + 1.0 / 3.0) / kParts * c);
            if (u + v + 1 < kParts) sum += f(a + (u + 2.0 / 3.0) / kParts * b + (v + 2.0 / 3.0) / kParts * c);
        }
    return sum / (kParts * kParts);
}

double mean_over(const TriangleMesh& mesh, const std::vector<std::size_t>& group,
                 const std::function<double(const Vec3&)>& f) {
    double sum = 0.0, area = 0.0;
    for (const std::size_t t : group) {
        sum += triangle_area(mesh, t) * mean_over_triangle(mesh, t, f);
        area += triangle_area(mesh, t);
    }
    return sum / area;
}

void Comparison::check(const Mean& mean, double truth) {
    const double deviation = mean.flux - truth, z = deviation / mean.error;
    CAPTURE(truth, mean.flux, mean.error, z);
    CHECK(mean.error > 0.0);
    CHECK(mean.error < 0.0025 * truth);
    CHECK(std::abs(deviation) < 0.005 * truth);
    CHECK(std::abs(z) < 4.5);
    beyond_ += std::abs(z) > 3.0;
    squares_ += z * z;
    ++count_;
}

void Comparison::verdict() const {
    const double n = count_, expected = n / 250.0;
    CAPTURE(count_, beyond_, squares_ / n);
    CHECK(beyond_ <= expected + 2.0 * std::sqrt(expected) + 1.0);
    CHECK(squares_ < n + 4.0 * std::sqrt(2.2 * n));
}

}  // namespace sidewall::flux
