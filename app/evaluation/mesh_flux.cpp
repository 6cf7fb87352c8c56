#include "app/evaluation/mesh_flux.hpp"

#include <tbb/parallel_for.h>

#include "app/common/interrupt.hpp"
#include "app/common/timing.hpp"
#include "flux/radiosity/method_choice.hpp"
#include "flux/radiosity/radiosity.hpp"
#include "flux/tracer/tracer.hpp"
#include "surface/infinity.hpp"

namespace sidewall::app {
namespace {

// What make() returns; the CPU seconds that it takes are added.
template <class Make>
auto timed(double& seconds, Make&& make) {
    const double start = cpu_seconds();
    auto made = make();
    seconds += cpu_seconds() - start;
    return made;
}

}  // namespace

MeshFlux::MeshFlux(const TriangleMesh& traced_mesh, const TriangleMesh& surface,
                   const flux::LateralBox& lateral)
    : mesh(traced_mesh),
      box(lateral),
      scene(timed(bvh_seconds, [&] { return surface::RayScene(mesh); })),
      wedges(timed(wedge_seconds, [&] { return flux::make_wedges(mesh); })),
      nearest(surface.vertices.size()) {
    tbb::parallel_for(std::size_t{0}, nearest.size(), [&](std::size_t n) {
        nearest[n] = scene.closest_point(surface.vertices[n], kInfinity);
    });
}

std::vector<double> MeshFlux::traced(double rays, double sticking, std::uint64_t seed,
                                     double& seconds) const {
    const flux::TraceOptions options{
        .rays = static_cast<std::uint64_t>(rays), .seed = seed, .stop = interrupted};
    return timed(seconds, [&] {
        return flux::trace_flux(mesh, scene, box, {.sticking = {sticking}}, {}, wedges, options).wedge.flux;
    });
}

std::vector<double> MeshFlux::solved(double rays, double sticking, std::uint64_t seed, bool errors,
                                     double& seconds) const {
    constexpr double kTolerance = 1e-4;  // as solve_fluxes_to takes for 2 %
    const auto most = static_cast<std::uint64_t>(rays);
    return timed(seconds, [&] {
        const std::vector<double> everywhere(wedges.count(), sticking);
        const flux::DiffuseSpecies species{.sticking = everywhere};
        flux::Exchange exchange(
            mesh, scene, box, wedges, {1.0},
            {.seed = seed, .most_bytes = flux::exchange_bytes(most + 1), .stop = interrupted});
        flux::gather_for({&species, 1}, exchange, most, {.stop = interrupted});
        return flux::solve_flux(exchange, species,
                                {.tolerance = kTolerance, .errors = errors, .stop = interrupted})
            .wedge.flux;
    });
}

std::vector<double> MeshFlux::at_vertices(std::span<const double> by_wedge) const {
    std::vector<double> values(nearest.size());
    for (std::size_t n = 0; n < nearest.size(); ++n)
        values[n] = flux::interpolate(wedges, by_wedge, nearest[n].triangle, nearest[n].u, nearest[n].v);
    return values;
}

std::vector<double> smoothed(std::vector<double> values, const TriangleMesh& surface, int rounds) {
    const std::vector<Vec3> normals = triangle_normals(surface);
    // A triangle passes values on only where it is in line with the vertex: creases stay sharp.
    std::vector<Vec3> vertex_normal(surface.vertices.size(), Vec3::Zero());
    for (std::size_t t = 0; t < surface.triangles.size(); ++t)
        for (const std::uint32_t v : surface.triangles[t]) vertex_normal[v] += area_vector(surface, t);
    for (Vec3& n : vertex_normal) n.normalize();
    constexpr double kInLine = 0.766;  // cos 40 degrees
    for (int round = 0; round < rounds; ++round) {
        std::vector<double> sum(values.size(), 0.0), weight(values.size(), 0.0);
        for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
            const auto [a, b, c] = surface.triangles[t];
            const double area = triangle_area(surface, t);
            const double mean = (values[a] + values[b] + values[c]) / 3.0;
            for (const std::uint32_t v : {a, b, c}) {
                if (vertex_normal[v].dot(normals[t]) < kInLine) continue;
                sum[v] += area * mean;
                weight[v] += area;
            }
        }
        for (std::size_t v = 0; v < values.size(); ++v)
            if (weight[v] > 0.0) values[v] = sum[v] / weight[v];
    }
    return values;
}

}  // namespace sidewall::app
