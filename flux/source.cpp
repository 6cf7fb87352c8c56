#include "flux/source.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "flux/reflection.hpp"
#include "flux/sampling.hpp"

namespace sidewall::flux {
namespace {

constexpr std::uint32_t kScramble = 0xffffffffu;  // bounce of the scrambling words; no particle reaches it
constexpr double kOnPlane = -1.0;                 // marks a particle that starts on the source plane

// A coordinate in [low, high] from 16 bits for the cell and 16 for the position within it, of which single
// precision keeps 8.
inline float coordinate(std::uint32_t cell, std::uint32_t within, float low, float high) {
    const float part = unit_float(cell << 16 | within);
    return std::min(high, low + part * (high - low));
}

// The two numbers from which a particle's direction is sampled.
struct Pair {
    std::uint32_t first, second;
};
inline Pair direction_numbers(const Batch& batch, std::uint32_t i) {
    return {owen_scrambled(reversed_bits(i), batch.scramble[0], batch.scramble[1]),
            owen_scrambled(sobol_second(i), batch.scramble[2], batch.scramble[3])};
}

// Assigns eight positions along the joint emission of plane and surface to one of the two. The plane's are
// rescaled to positions along its curve; the surface's become cumulative shares of its emission, from 0 to 1,
// in on_surface, which is kOnPlane for the others.
void share_out(double surface_share, std::uint32_t* along, double* on_surface) {
    const double plane = 1.0 - surface_share;
    for (std::size_t i = 0; i < kLanes; ++i) {
        const double at = unit_double(along[i]);
        on_surface[i] = at < plane ? kOnPlane : std::min((at - plane) / surface_share, 1.0);
        along[i] = static_cast<std::uint32_t>(std::min(at / plane, 1.0) * 0xffffffffp0);
    }
}

// Starts particles on the surface: triangle by cumulative emission, point by the emission's density, which is
// linear on a triangle, direction by Lambert's law, stratified over the batch like the plane's.
// \param place  by row: cumulative share of the surface's emission, or kOnPlane.
void emit_from_surface(const Geometry& geometry, const SurfaceSource& surface, RandomKey key,
                       const Batch& batch, const Column<double>& place, Rays& rays) {
    for (std::size_t row = 0; row < rays.count; ++row) {
        if (place[row] == kOnPlane) continue;
        const auto found = std::upper_bound(surface.until.begin(), surface.until.end() - 1, place[row]);
        const auto t = static_cast<std::uint32_t>(found - surface.until.begin());
        const Triangle& triangle = geometry.mesh.triangles[t];
        const std::uint32_t* wedge = &surface.corner[3 * std::size_t{t}];
        Stream random(key, {.ray = rays.ray[row], .batch = batch.number, .bounce = 0, .generation = 1});
        // The density is a mixture of the corners' hat functions. For the one picked, the barycentric weights
        // are Dirichlet(2, 1, 1): gaps between three sorted numbers, two of them for the picked corner.
        const double e0 = surface.emission[wedge[0]], e1 = surface.emission[wedge[1]],
                     e2 = surface.emission[wedge[2]];
        const double pick = random.uniform() * (e0 + e1 + e2);
        const std::size_t corner = pick < e0 ? 0 : pick < e0 + e1 ? 1 : 2;
        std::array<double, 3> u{random.uniform(), random.uniform(), random.uniform()};
        std::sort(u.begin(), u.end());
        const Vec3 normal = outward_normal(geometry, t);
        const Vec3 point = u[1] * geometry.mesh.vertices[triangle[corner]] +
                           (u[2] - u[1]) * geometry.mesh.vertices[triangle[(corner + 1) % 3]] +
                           (1.0 - u[2]) * geometry.mesh.vertices[triangle[(corner + 2) % 3]] +
                           geometry.skin * normal;
        rays.x[row] = static_cast<float>(std::clamp(point.x(), geometry.box.min[0], geometry.box.max[0]));
        rays.y[row] =
            geometry.revolution
                ? 0.0f
                : static_cast<float>(std::clamp(point.y(), geometry.box.min[1], geometry.box.max[1]));
        rays.z[row] = static_cast<float>(point.z());
        const Pair pair = direction_numbers(batch, rays.ray[row]);
        lambert(static_cast<float>(normal.x()), static_cast<float>(normal.y()),
                static_cast<float>(normal.z()), unit_float(pair.first), unit_float(pair.second), rays.dx[row],
                rays.dy[row], rays.dz[row]);
        rays.from[row] = t;
    }
}

void emit_positions(const Geometry& geometry, double surface_share, RandomKey key, const Batch& batch,
                    std::uint32_t first, Rays& rays, Column<double>& on_surface) {
    const auto min_x = static_cast<float>(geometry.box.min[0]),
               max_x = static_cast<float>(geometry.box.max[0]);
    const auto min_y = static_cast<float>(geometry.box.min[1]),
               max_y = static_cast<float>(geometry.box.max[1]);
    const auto top = static_cast<float>(geometry.top);
    alignas(32) std::uint32_t words[4][kLanes], along[kLanes];
    const std::uint64_t stride_high = batch.stride >> 32, stride_low = batch.stride & 0xffffffffu;
    for (std::size_t row = 0; row < rays.count; row += kLanes) {
        for (std::size_t i = 0; i < kLanes; ++i)
            rays.ray[row + i] = first + static_cast<std::uint32_t>(row + i);
        draw8(key, &rays.ray[row], {.batch = batch.number}, words);
        for (std::size_t i = 0; i < kLanes; ++i) {
            // Rows beyond the end of the batch only fill the last lanes.
            const std::uint64_t piece = std::min(rays.ray[row + i], batch.count - 1);
            // stride * word / 2^32
            const std::uint64_t jitter = stride_high * words[0][i] + (stride_low * words[0][i] >> 32);
            along[i] = static_cast<std::uint32_t>((piece * batch.stride + jitter) >> 32);
        }
        if (surface_share > 0.0) share_out(surface_share, along, &on_surface[row]);
        float* const x = &rays.x[row];
        float* const y = &rays.y[row];
        for (std::size_t i = 0; i < kLanes; ++i) {
            const auto [cell_x, cell_y] = hilbert_cell(along[i]);
            x[i] = coordinate(cell_x, words[1][i] >> 16, min_x, max_x);
            y[i] = coordinate(cell_y, words[1][i] & 0xffffu, min_y, max_y);
        }
        for (std::size_t i = 0; i < kLanes && geometry.revolution; ++i) y[i] = 0.0f;
        for (std::size_t i = 0; i < kLanes; ++i) rays.z[row + i] = top;
    }
}

// Directions of a thermal source, cosine about -z: the common case, in single precision.
void emit_thermal(const Batch& batch, Rays& rays) {
    for (std::size_t row = 0; row < rays.count; row += kLanes)
        for (std::size_t i = 0; i < kLanes; ++i) {
            const Pair pair = direction_numbers(batch, rays.ray[row + i]);
            lambert(0.0f, 0.0f, -1.0f, unit_float(pair.first), unit_float(pair.second), rays.dx[row + i],
                    rays.dy[row + i], rays.dz[row + i]);
        }
}

// Directions and energies of any other source, in double precision.
void emit_beam(const Species& species, RandomKey key, const Batch& batch, Rays& rays) {
    const double horizontal = std::hypot(species.beam.x(), species.beam.y());
    const auto set = [&](std::size_t row, const Vec3& d, double energy) {
        set_vector(d, rays.dx, rays.dy, rays.dz, row);
        rays.energy[row] = static_cast<float>(energy);
    };
    for (std::size_t row = 0; row < rays.count; ++row) {
        Stream random(key, {.ray = rays.ray[row], .batch = batch.number, .bounce = 0, .generation = 1});
        Vec3 axis = species.beam;
        if (species.rotating) {
            const double azimuth = 2.0 * std::numbers::pi * random.uniform();
            axis = {horizontal * std::cos(azimuth), horizontal * std::sin(azimuth), axis.z()};
        }
        const Pair pair = direction_numbers(batch, rays.ray[row]);
        if (!species.bins.empty()) {
            auto [d, energy] = sample_bins(species.bins, axis, unit_double(pair.first),
                                           unit_double(pair.second), random.uniform());
            while (!(d.z() < -1e-6)) {
                const double u1 = random.uniform(), u2 = random.uniform(), u3 = random.uniform();
                std::tie(d, energy) = sample_bins(species.bins, axis, u1, u2, u3);
            }
            set(row, d, energy);
            continue;
        }
        if (species.source_beta != 0.0) {
            Vec3 d = sample_cosine_beta(axis, species.source_beta, unit_double(pair.first),
                                        unit_double(pair.second));
            while (!(d.z() < -1e-6)) {
                const double u1 = random.uniform(), u2 = random.uniform();
                d = sample_cosine_beta(axis, species.source_beta, u1, u2);
            }
            set(row, d, 0.0);
            continue;
        }
        Vec3 d = sample_cosine_power(axis, species.source_exponent, unit_double(pair.first),
                                     unit_double(pair.second));
        while (!(d.z() < -1e-6)) {
            const double u1 = random.uniform(), u2 = random.uniform();
            d = sample_cosine_power(axis, species.source_exponent, u1, u2);
        }
        double energy = species.energy.mean;
        if (species.energy.sigma > 0.0) do
                energy = species.energy.mean + species.energy.sigma * sample_normal(random);
            while (!(energy > 0.0));
        set(row, d, energy);
    }
}

}  // namespace

Batch make_batch(RandomKey key, std::uint32_t number, std::uint32_t count) {
    Batch batch{number, count, count == 1 ? ~std::uint64_t{0} : ~std::uint64_t{0} / count, {}};
    Stream random(key, {.batch = number, .bounce = kScramble});
    for (std::uint32_t& word : batch.scramble) word = random.next();
    return batch;
}

SurfaceSource make_surface_source(const TriangleMesh& mesh, const Wedges& wedges,
                                  std::span<const double> emission, double plane) {
    SurfaceSource source;
    double sum = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size() && !emission.empty(); ++t) {
        const std::uint32_t* wedge = &wedges.corner[3 * t];
        const double mean = (emission[wedge[0]] + emission[wedge[1]] + emission[wedge[2]]) / 3.0;
        sum += triangle_area(mesh, t) * mean;
        source.until.push_back(sum);
    }
    if (!(sum > 0.0)) return {};
    for (double& until : source.until) until /= sum;
    source.share = sum / (sum + plane);
    source.emission.assign(emission.begin(), emission.end());
    source.corner = wedges.corner;
    return source;
}

void emit(const Geometry& geometry, const Species& species, const SurfaceSource& surface, RandomKey key,
          const Batch& batch, std::uint32_t first, std::uint32_t count, Rays& rays) {
    rays.count = count;
    Column<double> on_surface;
    emit_positions(geometry, surface.share, key, batch, first, rays, on_surface);
    const bool thermal = species.source_exponent == 1.0 && species.beam.z() == -1.0 &&
                         species.energy.mean == 0.0 && species.bins.empty() && species.source_beta == 0.0;
    if (thermal)
        emit_thermal(batch, rays);
    else
        emit_beam(species, key, batch, rays);
    for (std::size_t row = 0; row < count; ++row) {
        rays.from[row] = 0xffffffffu;
        rays.weight[row] = kOne;
    }
    // In an axial box, starts are uniform in r, so that the axis, where holes are, gets enough of them; the
    // weight 2 r / r_max stands for the area of the ring.
    for (std::size_t row = 0; row < count && geometry.revolution; ++row)
        if (surface.share == 0.0 || on_surface[row] == kOnPlane)
            rays.weight[row] = static_cast<std::uint64_t>(
                2.0 * static_cast<double>(rays.x[row]) / geometry.box.max[0] * static_cast<double>(kOne) +
                0.5);
    if (surface.share > 0.0) emit_from_surface(geometry, surface, key, batch, on_surface, rays);
}

}  // namespace sidewall::flux
