#include "flux/radiosity/residual.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "flux/radiosity/exchange_samples.hpp"
#include "flux/sampling.hpp"
#include "flux/tracer/packets.hpp"

namespace sidewall::flux {
namespace {

constexpr std::uint32_t kPoints = 3, kRaysOfSet = kPoints * kResidualDirections, kRaysOfEdge = 2 * kRaysOfSet;
constexpr std::size_t kEdgesOfBlock = kBlock / kRaysOfEdge;
constexpr std::uint32_t kEdgeStream = 0xfffffffeu;  // bounce that no ray of a gather has
// Factor that moves the points towards the triangle's centroid: along the foot of a wall, rounding decides
// whether a ray hits. Second differences become smaller by the square of the factor.
constexpr double kInwards = 0.98;

// The two ends and the middle of an edge, moved inwards and lifted off the triangle by the geometry's skin.
std::array<Vec3, kPoints> points_of(const Geometry& geometry, const Facet& facet, std::uint32_t edge) {
    const std::array<Vec3, 3> corners{Vec3::Zero(), facet.edge1, facet.edge2};
    const Vec3 centroid = (facet.edge1 + facet.edge2) / 3.0;
    std::array<Vec3, kPoints> points{corners[edge], corners[(edge + 1) % 3], {}};
    points[2] = 0.5 * (points[0] + points[1]);
    for (Vec3& point : points) {
        point = facet.corner + centroid + kInwards * (point - centroid) + geometry.skin * facet.normal;
        for (int axis = 0; axis < 2; ++axis)
            point[axis] = std::clamp(point[axis], geometry.box.min[axis], geometry.box.max[axis]);
        if (geometry.revolution) point.y() = 0.0;
    }
    return points;
}

// Adds the rays of one edge to the block.
void aim(const Geometry& geometry, const RayDensities& densities, RandomKey key, std::uint32_t gather,
         std::uint32_t number, const ResidualEdge& edge, Rays& rays) {
    const Facet& facet = densities.facets()[edge.triangle];
    const std::array<Vec3, kPoints> points = points_of(geometry, facet, edge.edge);
    Stream words(key, {.ray = number, .batch = gather, .bounce = kEdgeStream, .generation = 1});
    for (int set = 0; set < 2; ++set) {
        std::array<std::uint32_t, 4> scramble;
        for (std::uint32_t& word : scramble) word = words.next();
        for (std::uint32_t i = 0; i < kResidualDirections; ++i) {
            const double first = unit_double(owen_scrambled(reversed_bits(i), scramble[0], scramble[1])),
                         second = unit_double(owen_scrambled(sobol_second(i), scramble[2], scramble[3]));
            const Vec3 direction = sample_lambertian(facet.normal, first, second);
            for (const Vec3& point : points) {
                const std::size_t row = rays.count++;
                rays.set(row, point, direction);
                rays.from[row] = edge.triangle;
            }
        }
    }
}

// Draws the edges of a gather, stratified along the space-filling curve of the triangles.
std::vector<ResidualEdge> draw_edges(const RayDensities& densities, RandomKey key, std::uint32_t gather,
                                     std::size_t count, std::span<const double> share) {
    const std::size_t items = densities.facets().size();
    std::vector<double> weights(items);
    for (std::size_t i = 0; i < items; ++i)
        weights[i] = share.empty() ? densities.starts().share(i) : share[densities.start_triangle(i)];
    Distribution where;
    where.assign(weights);
    std::vector<ResidualEdge> edges;
    for (std::uint32_t i = 0; i < count; ++i) {
        const Draws random = draw(key, std::uint64_t{gather} << 32 | i, kEdgeStream);
        const Distribution::Pick pick = where.pick((i + random.uniform(0)) / static_cast<double>(count));
        edges.push_back({densities.start_triangle(pick.item),
                         std::min(2u, static_cast<std::uint32_t>(3.0 * random.uniform(1))),
                         where.share(pick.item) * static_cast<double>(items)});
    }
    return edges;
}

// The second difference of the arrivals along an edge, from one of its two sets of rays.
double bend_of(const ProfileUnknowns& profile, std::span<const ResidualRay> rays,
               std::span<const double> emitted, double source, double exponent) {
    const auto value = [&](const ResidualRay& ray) {
        if (ray.triangle != surface::kNoTriangle)
            return interpolate(profile.unknowns, emitted, ray.triangle, static_cast<double>(ray.u),
                               static_cast<double>(ray.v));
        return ray.u > 0.0f ? source * lobe(exponent, static_cast<double>(ray.u)) : 0.0;
    };
    double sum = 0.0;
    for (std::size_t i = 0; i < rays.size(); i += kPoints)
        sum += value(rays[i + 2]) - 0.5 * (value(rays[i]) + value(rays[i + 1]));
    return sum / (kResidualDirections * kInwards * kInwards);
}

// Gradient of the flux on a triangle.
Vec3 slope_of(const TriangleMesh& mesh, const Wedges& wedges, std::span<const double> flux, std::size_t t) {
    const Vec3 corner = mesh.vertices[mesh.triangles[t][0]];
    const Vec3 edge1 = mesh.vertices[mesh.triangles[t][1]] - corner,
               edge2 = mesh.vertices[mesh.triangles[t][2]] - corner;
    const Vec3 normal = edge1.cross(edge2);
    const double square = normal.squaredNorm();
    if (!(square > 0.0)) return Vec3::Zero();
    const std::uint32_t* wedge = &wedges.corner[3 * t];
    return ((flux[wedge[1]] - flux[wedge[0]]) * edge2.cross(normal) +
            (flux[wedge[2]] - flux[wedge[0]]) * normal.cross(edge1)) /
           square;
}

}  // namespace

void trace_residual(const Geometry& geometry, const RayDensities& densities, RandomKey key,
                    std::uint32_t gather, std::uint64_t rays, Residual& residual) {
    const auto wanted = static_cast<std::size_t>(kResidualShare * static_cast<double>(rays) / kRaysOfEdge);
    const std::size_t count = std::min(wanted, kMostResidualEdges - residual.edges.size());
    if (count == 0) return;
    const std::vector<ResidualEdge> edges = draw_edges(densities, key, gather, count, residual.share);
    const std::size_t first = residual.edges.size();
    residual.edges.insert(residual.edges.end(), edges.begin(), edges.end());
    residual.rays.resize(residual.edges.size() * kRaysOfEdge);
    const std::size_t blocks = (edges.size() + kEdgesOfBlock - 1) / kEdgesOfBlock;
    std::vector<FlightCounts> flights(blocks);
    tbb::parallel_for(std::size_t{0}, blocks, [&](std::size_t block) {
        static thread_local Rays flying;  // too large for a stack frame
        static thread_local FlightStarts begun;
        Rays& r = flying;
        r.count = 0;
        const std::size_t begin = block * kEdgesOfBlock, end = std::min(begin + kEdgesOfBlock, edges.size());
        for (std::size_t i = begin; i < end; ++i)
            aim(geometry, densities, key, gather, static_cast<std::uint32_t>(i), edges[i], r);
        begun = r;
        fly_block(geometry, r, flights[block]);
        for (std::size_t row = 0; row < r.count; ++row) {
            ResidualRay& ray = residual.rays[(first + begin) * kRaysOfEdge + row];
            ray = {r.triangle[row], r.u[row], r.v[row]};
            if (ray.triangle != surface::kNoTriangle && ray.triangle != kLeaked) continue;
            const bool lit = ray.triangle != kLeaked &&
                             domain_exit(geometry, begun.point(row), begun.direction(row)).to_source;
            ray = {surface::kNoTriangle, lit ? begun.dz[row] : 0.0f, 0.0f};
        }
    });
    for (const FlightCounts& counts : flights) residual.segments += counts.segments;
}

std::vector<double> shares_of_edges(const RayDensities& densities, std::span<const double> error) {
    constexpr double kExpected = 0.8;
    double total = 0.0;
    for (std::size_t t = 0; t < error.size(); ++t) total += densities.facets()[t].area * error[t];
    std::vector<double> share(error.size());
    for (std::size_t i = 0; i < error.size(); ++i) {
        const std::uint32_t t = densities.start_triangle(i);
        const double even = densities.starts().share(i);
        share[t] = total > 0.0
                       ? (1.0 - kExpected) * even + kExpected * densities.facets()[t].area * error[t] / total
                       : even;
    }
    return share;
}

std::vector<double> expected_bends(const TriangleMesh& mesh, const Wedges& wedges,
                                   std::span<const double> flux) {
    std::vector<Vec3> slope(wedges.count(), Vec3::Zero());
    std::vector<double> area(wedges.count(), 0.0);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Vec3 own = slope_of(mesh, wedges, flux, t);
        const double size = triangle_area(mesh, t);
        for (std::size_t k = 0; k < 3; ++k) {
            slope[wedges.corner[3 * t + k]] += size * own;
            area[wedges.corner[3 * t + k]] += size;
        }
    }
    for (std::size_t w = 0; w < slope.size(); ++w)
        if (area[w] > 0.0) slope[w] /= area[w];
    // At a crease the mean slope is one-sided, that of half an edge away: the factor is then twice as large.
    const auto split = [&](std::uint32_t v) { return wedges.first[v + 1] > wedges.first[v] + 1; };
    std::vector<double> bends(3 * mesh.triangles.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t next = (k + 1) % 3;
            const Vec3 edge = mesh.vertices[mesh.triangles[t][next]] - mesh.vertices[mesh.triangles[t][k]];
            const bool one_sided = split(mesh.triangles[t][k]) != split(mesh.triangles[t][next]);
            bends[3 * t + k] =
                (one_sided ? 0.25 : 0.125) *
                (slope[wedges.corner[3 * t + k]] - slope[wedges.corner[3 * t + next]]).dot(edge);
        }
    return bends;
}

// The linear interpolant of a quadratic with bends q is off by the sum over edges of 4 q l l', with l and l'
// the barycentric coordinates of the edge's ends. Elements with a consistent mass matrix shift this by its
// mean; the mean square of the rest is (4 sum of q^2 - (sum of q)^2) / 45.
std::vector<double> errors_of(std::span<const double> bends) {
    std::vector<double> errors(bends.size() / 3);
    for (std::size_t t = 0; t < errors.size(); ++t) {
        const double a = bends[3 * t], b = bends[3 * t + 1], c = bends[3 * t + 2], sum = a + b + c;
        errors[t] = std::sqrt((4.0 * (a * a + b * b + c * c) - sum * sum) / 45.0);
    }
    return errors;
}

// The factor's square is a ratio of means over the edges. It is averaged with a prior of 1, so that few or
// noisy edges do not decide. The prior's variance is the square of the ratio's deviation from 1, less that of
// three standard errors of the ratio, and at least 1.
double bend_factor(const Geometry& geometry, const ProfileUnknowns& profile, const Residual& residual,
                   std::span<const double> bends, std::span<const double> one, std::span<const double> other,
                   double source, double exponent) {
    constexpr std::size_t kFewest = 16;
    constexpr double kLeast = 0.25;  // least square of the factor: noise steepens slopes by no more
    const std::size_t count = residual.edges.size();
    if (count < kFewest) return 1.0;
    source *= lobe_scale(exponent);
    std::vector<double> seen(count), said(count);
    for (std::size_t i = 0; i < count; ++i) {
        const ResidualEdge& edge = residual.edges[i];
        const auto bend = [&](std::span<const double> emitted, std::size_t set) {
            const std::span rays(&residual.rays[i * kRaysOfEdge + set * kRaysOfSet], kRaysOfSet);
            return bend_of(profile, rays, emitted, source, exponent);
        };
        const double area = triangle_area(geometry.mesh, edge.triangle);
        seen[i] = area * bend(one, 0) * bend(other, 1) / edge.density;
        said[i] = area * std::pow(bends[3 * edge.triangle + edge.edge], 2.0) / edge.density;
    }
    const double sum = std::accumulate(said.begin(), said.end(), 0.0);
    if (!(sum > 0.0)) return 1.0;
    const double square = std::accumulate(seen.begin(), seen.end(), 0.0) / sum;
    double variance = 0.0;
    for (std::size_t i = 0; i < count; ++i) variance += std::pow(seen[i] - square * said[i], 2.0);
    variance *= static_cast<double>(count) / static_cast<double>(count - 1) / (sum * sum);
    const double prior = std::max(1.0, (square - 1.0) * (square - 1.0) - 9.0 * variance);
    return std::sqrt(std::max(kLeast, (prior * square + variance) / (prior + variance)));
}

}  // namespace sidewall::flux
