#include "flux/tracer/adjoint.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace sidewall::flux {
namespace {

// Least n of the source's cos^n: at 50, 1e-8 of the particles fly more than 46 degrees off the vertical.
constexpr double kLeastExponent = 50.0;

constexpr std::uint32_t kCorners = 3;

// Every batch needs paths on every triangle; with few rays, standard errors come from as few batches as this.
constexpr std::uint64_t kLeastBatches = 4;

std::uint64_t fewest_of_batch(const TriangleMesh& mesh) {
    return std::uint64_t{kCorners} * mesh.triangles.size();
}

// Starts of adjoint paths, by row of their rays: position and direction, barycentric weights, and the weight
// of the particle if the path reaches the source.
struct AdjointStarts : FlightStarts {
    Column<float> u, v;
    Column<double> weight;
};

// Replaces the particles drawn by emit() with starts on the surface in the opposite direction. Directions
// that point into the surface are dropped.
void draw_starts(const Trace& trace, const Batch& batch, Rays& r, AdjointStarts& starts) {
    const Geometry& geometry = trace.geometry;
    const auto triangles = static_cast<std::uint32_t>(geometry.mesh.triangles.size());
    const std::uint32_t each = batch.count / triangles;
    const double share = static_cast<double>(triangles) / geometry.box.area();
    std::size_t kept = 0;
    for (std::size_t row = 0; row < r.count; ++row) {
        const std::uint32_t ray = r.ray[row], triangle = ray / each, turn = ray % kCorners;
        const Triangle& corner = geometry.mesh.triangles[triangle];
        const Vec3 area = 0.5 * area_vector(geometry.mesh, triangle);
        const Vec3 down = r.direction(row);
        const double across = -down.dot(area);
        if (!(across > 0.0)) continue;
        // emit() has used numbers 0 and 1 of this event.
        const Draws random = draw(trace.key, std::uint64_t{batch.number} << 32 | (ray - turn), 0);
        const double root = std::sqrt(random.uniform(2)), part = random.uniform(3);
        const std::array weights{1.0 - root, root * (1.0 - part), root * part};
        const double u = weights[(turn + 1) % kCorners], v = weights[(turn + 2) % kCorners];
        const Vec3& a = geometry.mesh.vertices[corner[0]];
        Vec3 place = a + u * (geometry.mesh.vertices[corner[1]] - a) +
                     v * (geometry.mesh.vertices[corner[2]] - a) + geometry.skin * area.normalized();
        for (int axis = 0; axis < 2; ++axis)
            place[axis] = std::clamp(place[axis], geometry.box.min[axis], geometry.box.max[axis]);
        if (geometry.revolution) place.y() = 0.0;
        r.set(kept, place, -down);
        r.from[kept] = triangle;
        r.ray[kept] = ray;
        r.energy[kept] = r.energy[row];
        starts.copy(kept, r, kept);
        starts.u[kept] = static_cast<float>(u), starts.v[kept] = static_cast<float>(v);
        starts.weight[kept] = share * across / -down.z();
        ++kept;
    }
    r.count = kept;
}

// Turns an adjoint path that reached the source into a particle that hits the surface at the path's start.
void place_arrival(const Trace& trace, const AdjointStarts& starts, std::size_t row, std::size_t kept,
                   Rays& r) {
    const Vec3 normal = area_vector(trace.geometry.mesh, r.from[row]);
    const Vec3 skin = trace.geometry.skin * normal.normalized();
    r.set(kept, starts.point(row) - skin, -starts.direction(row));
    r.distance[kept] = 0.0f;
    r.triangle[kept] = r.from[row];
    r.u[kept] = starts.u[row], r.v[kept] = starts.v[row];
    set_vector(normal, r.nx, r.ny, r.nz, kept);
    r.ray[kept] = r.ray[row];
    r.energy[kept] = r.energy[row];
    r.weight[kept] = static_cast<std::uint64_t>(starts.weight[row] * static_cast<double>(kOne) + 0.5);
}

}  // namespace

bool allows_adjoint(const Species& species) {
    return species.source_exponent >= kLeastExponent && species.bins.empty() && species.source_beta == 0.0 &&
           is_untilted(species) && !std::isfinite(species.mean_free_path) && !species.desorbs;
}

std::uint64_t fewest_adjoint_paths(const TriangleMesh& mesh) {
    return kLeastBatches * fewest_of_batch(mesh);
}

std::pair<std::uint64_t, std::uint32_t> adjoint_batches(std::uint64_t rays, std::uint64_t most,
                                                        const TriangleMesh& mesh) {
    const std::uint64_t least = fewest_of_batch(mesh);
    const std::uint64_t batches =
        std::max((rays + kMostBatchRays - 1) / kMostBatchRays, std::clamp(rays / least, kLeastBatches, most));
    return {batches, static_cast<std::uint32_t>(std::max<std::uint64_t>(1, rays / batches / least) * least)};
}

bool uses_adjoint(std::span<const Species> pass, const TriangleMesh& mesh, const TraceOptions& options) {
    const std::uint64_t fewest = fewest_adjoint_paths(mesh);
    return options.adjoint && pass.size() == 1 && allows_adjoint(pass.front()) && fewest <= options.rays &&
           fewest <= kLeastBatches * kMostBatchRays;
}

void emit_adjoint(const Trace& trace, const Batch& batch, std::uint32_t first, std::uint32_t count,
                  Worker& w) {
    static thread_local AdjointStarts starts;  // too large for a stack frame
    Rays& r = w.rays;
    Counts& counts = w.counts.front();
    emit(trace.geometry, trace.species, {}, trace.key, batch, first, count, r);
    draw_starts(trace, batch, r, starts);
    counts.escaped += count - r.count;
    fly_block(trace.geometry, r, w.flights);
    std::size_t kept = 0;
    for (std::size_t row = 0; row < r.count; ++row) {
        if (r.triangle[row] == kLeaked) {
            ++counts.leaked;
        } else if (r.triangle[row] == surface::kNoTriangle &&
                   domain_exit(trace.geometry, starts.point(row), starts.direction(row)).to_source) {
            place_arrival(trace, starts, row, kept, r);
            counts.ledger.emitted += r.weight[kept++];
        } else {
            ++counts.escaped;
        }
    }
    r.count = kept;
}

}  // namespace sidewall::flux
