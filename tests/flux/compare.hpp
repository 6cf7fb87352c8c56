#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "flux/mend.hpp"
#include "tests/flux/meshes.hpp"

// How tests compare traced fluxes with exact ones: means over groups of triangles with honest errors,
// integrals of an exact flux over the same triangles, and the same surface placed otherwise.
namespace sidewall::flux {

using Groups = std::vector<std::vector<std::size_t>>;  // of triangles

/// Mean flux of every species, traced together, on every group over independent traces of \p rays together,
/// other ones for another \p stream. The standard error is the scatter of the traces: it holds whatever the
/// correlation between triangles.
inline std::vector<std::vector<Mean>> over_seeds(const TriangleMesh& mesh, std::array<Boundary, 2> boundary,
                                                 std::span<const Species> species, std::uint64_t rays,
                                                 std::uint32_t stream, const Groups& groups,
                                                 std::span<const std::int32_t> materials = {},
                                                 double roulette = 1.0) {
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
inline std::vector<Mean> over_seeds(const TriangleMesh& mesh, std::array<Boundary, 2> boundary,
                                    const Species& species, std::uint64_t rays, std::uint32_t stream,
                                    const Groups& groups, std::span<const std::int32_t> materials = {},
                                    double roulette = 1.0) {
    return over_seeds(mesh, boundary, std::span(&species, 1), rays, stream, groups, materials, roulette)
        .front();
}

/// Mean of \p f over the triangle: values at the centres of 64 equal parts.
inline double mean_over_triangle(const TriangleMesh& mesh, std::size_t t,
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

/// Area-weighted mean of \p f over the triangles of a group.
inline double mean_over(const TriangleMesh& mesh, const std::vector<std::size_t>& group,
                        const std::function<double(const Vec3&)>& f) {
    double sum = 0.0, area = 0.0;
    for (const std::size_t t : group) {
        sum += triangle_area(mesh, t) * mean_over_triangle(mesh, t, f);
        area += triangle_area(mesh, t);
    }
    return sum / area;
}

/// Checks of many means against exact values. Each must be within 0.5 %; of 3 standard errors, chance lets 1
/// in 250 fall short (Student's t of 63 degrees of freedom), which verdict() allows for.
class Comparison {
  public:
    void check(const Mean& mean, double truth) {
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
    /// To be called once, at the end.
    void verdict() const {
        const double n = count_, expected = n / 250.0;
        CAPTURE(count_, beyond_, squares_ / n);
        CHECK(beyond_ <= expected + 2.0 * std::sqrt(expected) + 1.0);
        CHECK(squares_ < n + 4.0 * std::sqrt(2.2 * n));
    }

  private:
    int count_ = 0, beyond_ = 0;
    double squares_ = 0.0;
};

/// A surface placed otherwise, and the way back: from a point on it to the point of the original.
struct Placed {
    const char* how;
    TriangleMesh mesh;
    std::function<Vec3(const Vec3&)> back;
};

inline Placed placed_mirrored(TriangleMesh mesh) {
    for (Vec3& p : mesh.vertices) p.x() = -p.x();
    for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
    return {"mirrored", std::move(mesh), [](const Vec3& p) { return Vec3(-p.x(), p.y(), p.z()); }};
}

inline Placed placed_turned(const TriangleMesh& mesh) {
    return {"turned by 90 degrees", turned(mesh), [](const Vec3& p) { return Vec3(p.y(), -p.x(), p.z()); }};
}

/// Cuts a periodic surface at \p axis = \p plane and moves the lower part up by a period. Triangles are
/// split; attributes are lost.
inline TriangleMesh wrapped(const TriangleMesh& mesh, int axis, double plane) {
    constexpr double kNear = 1e-7;
    const Box3 bounds = bounding_box(mesh);
    const double low = bounds.min[axis], high = bounds.max[axis], period = high - low;
    TriangleMesh result;
    std::vector<Vec3> points = mesh.vertices;
    for (Vec3& p : points)
        if (std::abs(p[axis] - plane) < kNear) p[axis] = plane;
    std::map<std::pair<std::uint32_t, std::uint32_t>, Vec3> cuts;  // of edges, the same from both triangles
    const auto cut = [&](std::uint32_t a, std::uint32_t b) {
        const auto edge = std::minmax(a, b);
        const auto [found, made] = cuts.try_emplace({edge.first, edge.second});
        if (made) {
            const Vec3 &p = points[edge.first], &q = points[edge.second];
            found->second = p + (plane - p[axis]) / (q[axis] - p[axis]) * (q - p);
            found->second[axis] = plane;
        }
        return found->second;
    };
    for (const Triangle& t : mesh.triangles)
        for (const double side : {-1.0, 1.0}) {
            std::vector<Vec3> polygon;
            bool beyond = false;
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint32_t a = t[k], b = t[(k + 1) % 3];
                const double at = side * (points[a][axis] - plane), to = side * (points[b][axis] - plane);
                beyond |= at > 0.0;
                if (at >= 0.0) polygon.push_back(points[a]);
                if (at * to < 0.0) polygon.push_back(cut(a, b));
            }
            if (!beyond) continue;
            const auto first = static_cast<std::uint32_t>(result.vertices.size());
            for (Vec3 p : polygon) {
                if (side < 0.0) p[axis] = p[axis] == low ? high : p[axis] + period;
                // Opposite sides match to the last bits only.
                for (int k = 0; k < 3; ++k) p[k] = std::round(p[k] * 0x1p28) * 0x1p-28;
                result.vertices.push_back(p);
            }
            for (std::uint32_t k = 1; k + 1 < polygon.size(); ++k)
                result.triangles.push_back({first, first + k, first + k + 1});
        }
    mend(result);  // welds
    return result;
}

/// The periodic domain shifted along both axes, its sides anywhere on the surface. \p back is exact within
/// half a period of \p centre, a point of the original.
inline Placed placed_shifted(const TriangleMesh& mesh, double plane_x, double plane_y, const Vec3& centre) {
    const Vec3 size = bounding_box(mesh).size();
    return {"shifted", wrapped(wrapped(mesh, 0, plane_x), 1, plane_y), [size, centre](const Vec3& p) {
                return Vec3(centre.x() + std::remainder(p.x() - centre.x(), size.x()),
                            centre.y() + std::remainder(p.y() - centre.y(), size.y()), p.z());
            }};
}

}  // namespace sidewall::flux
