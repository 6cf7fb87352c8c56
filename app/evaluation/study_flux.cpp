#include "app/evaluation/study_flux.hpp"

#include "app/common/interrupt.hpp"
#include "app/common/json.hpp"
#include "app/common/timing.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "flux/radiosity/method_choice.hpp"
#include "flux/tracer/tracer.hpp"
#include "flux/wedges.hpp"
#include "surface/ray_scene.hpp"

namespace sidewall::app {
namespace {

// What make() returns, and the CPU seconds that it takes.
template <class Make>
auto timed(double& seconds, Make&& make) {
    const double start = cpu_seconds();
    auto made = make();
    seconds = cpu_seconds() - start;
    return made;
}

// The flux by wedge; its rays are added to \p pair.
std::vector<double> traced_flux(const TriangleMesh& mesh, const surface::RayScene& scene,
                                const flux::LateralBox& box, const flux::Wedges& wedges, std::uint64_t rays,
                                double sticking, std::uint64_t seed, FluxPair& pair) {
    flux::Species species;
    species.sticking = {sticking};
    flux::TraceOptions options;
    options.rays = rays;
    options.seed = seed;
    options.stop = interrupted;
    flux::FluxResult result = flux::trace_flux(mesh, scene, box, species, {}, wedges, options);
    pair.rays += static_cast<double>(result.emitted);
    pair.segments += static_cast<double>(result.segments);
    return std::move(result.wedge.flux);
}

// The same by radiosity.
std::vector<double> solved(const TriangleMesh& mesh, const surface::RayScene& scene,
                           const flux::LateralBox& box, const flux::Wedges& wedges, std::uint64_t rays,
                           double sticking, std::uint64_t seed, FluxPair& pair) {
    const std::vector<double> everywhere(wedges.count(), sticking);
    flux::Exchange exchange(
        mesh, scene, box, wedges, {1.0},
        {.seed = seed, .most_bytes = flux::exchange_bytes(rays + 1), .stop = interrupted});
    const flux::DiffuseSpecies species{.sticking = everywhere};
    flux::gather_for({&species, 1}, exchange, rays, {.stop = interrupted});
    constexpr double kTolerance = 1e-4;  // as solve_fluxes_to takes for 2 %
    flux::RadiosityFlux result =
        flux::solve_flux(exchange, species, {.tolerance = kTolerance, .stop = interrupted});
    pair.rays += static_cast<double>(exchange.rays());
    pair.segments += static_cast<double>(exchange.segments());
    return std::move(result.wedge.flux);
}

// Sums over some vertices, weighted by area.
struct Sums {
    double truth = 0.0;   // product of both reference runs: the squared flux, without their noise
    double bias = 0.0;    // product of both runs' errors, each against another reference run
    double spread = 0.0;  // half the squared difference: the variance of one run
    double flux = 0.0, area = 0.0;
    void add(double a, double first, double second, double true_first, double true_second) {
        truth += a * true_first * true_second;
        bias += a * (first - true_first) * (second - true_second);
        spread += a * 0.5 * (first - second) * (first - second);
        flux += a * 0.5 * (true_first + true_second);
        area += a;
    }
    double relative(double square) const {
        return truth > 0.0 ? std::sqrt(std::max(0.0, square) / truth) : 0.0;
    }
};

}  // namespace

PairTrace::PairTrace(const TriangleMesh& mesh, const TriangleMesh& surface, const flux::LateralBox& box)
    : mesh_(mesh),
      box_(box),
      scene_(timed(pair.bvh_seconds, [&] { return surface::RayScene(mesh); })),
      wedges_(timed(pair.wedge_seconds, [&] { return flux::make_wedges(mesh); })),
      feet_(surface.vertices.size()) {
    tbb::parallel_for(std::size_t{0}, feet_.size(), [&](std::size_t n) {
        const auto hit = scene_.closest_point(surface.vertices[n], std::numeric_limits<double>::infinity());
        feet_[n] = {hit.triangle, hit.u, hit.v};
    });
}

void PairTrace::turn(double rays, double sticking, std::uint64_t seed, bool radiosity) {
    const auto half = static_cast<std::uint64_t>(std::max(1.0, 0.5 * rays));
    const double start = cpu_seconds();
    const std::vector<double> flux =
        radiosity ? solved(mesh_, scene_, box_, wedges_, half, sticking, seed, pair)
                  : traced_flux(mesh_, scene_, box_, wedges_, half, sticking, seed, pair);
    pair.trace_seconds += cpu_seconds() - start;
    (pair.first.empty() ? pair.first : pair.second) = at_vertices(flux);
}

FluxPair PairTrace::take() {
    FluxPair next{.bvh_seconds = pair.bvh_seconds, .wedge_seconds = pair.wedge_seconds};
    return std::exchange(pair, std::move(next));
}

std::vector<double> PairTrace::at_vertices(std::span<const double> by_wedge) const {
    std::vector<double> values(feet_.size());
    for (std::size_t n = 0; n < feet_.size(); ++n)
        values[n] = flux::interpolate(wedges_, by_wedge, feet_[n].triangle, feet_[n].u, feet_[n].v);
    return values;
}

FluxPair trace_pair(const TriangleMesh& mesh, const TriangleMesh& surface, const flux::LateralBox& box,
                    double rays, double sticking, std::uint64_t seed, bool radiosity) {
    PairTrace trace(mesh, surface, box);
    for (int turn = 0; turn < 2; ++turn) trace.turn(rays, sticking, seed++, radiosity);
    return std::move(trace.pair);
}

FluxTruth make_truth(const TriangleMesh& surface, const flux::LateralBox& box, double rays, double sticking) {
    FluxTruth truth{&surface, box, std::vector<double>(surface.vertices.size(), 0.0), {}};
    for (std::size_t t = 0; t < surface.triangles.size(); ++t)
        for (const std::uint32_t v : surface.triangles[t])
            truth.vertex_area[v] += triangle_area(surface, t) / 3.0;
    constexpr std::uint64_t kSeed = 1'000'003;  // away from the seeds of what is compared with it
    truth.flux = trace_pair(surface, surface, box, rays, sticking, kSeed);
    return truth;
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

FluxPair smoothed(const FluxPair& pair, const TriangleMesh& surface, int rounds) {
    FluxPair result = pair;
    for (auto* values : {&result.first, &result.second})
        *values = smoothed(std::move(*values), surface, rounds);
    return result;
}

Json flux_error(const FluxPair& pair, const FluxTruth& truth, double target) {
    constexpr std::size_t kSlices = 5;
    const Box3 box = bounding_box(*truth.surface);
    const double height = std::max(box.size().z(), 1e-300);
    Sums all;
    std::vector<Sums> slice(kSlices);
    for (std::size_t v = 0; v < truth.vertex_area.size(); ++v) {
        const double z = (truth.surface->vertices[v].z() - box.min.z()) / height;
        const auto s = std::min(kSlices - 1, static_cast<std::size_t>(z * kSlices));
        for (Sums* sums : {&all, &slice[s]})
            sums->add(truth.vertex_area[v], pair.first[v], pair.second[v], truth.flux.first[v],
                      truth.flux.second[v]);
    }
    // One run has half of the rays; both together have half of its variance.
    const double bias = all.relative(all.bias), noise = all.relative(0.5 * all.spread);
    Json json{{"bias", bias}, {"noise", noise}, {"error", std::hypot(bias, noise)}};
    const double left = target * target - bias * bias;
    if (left > 0.0) {
        const double rays = pair.rays * noise * noise / left;
        json["rays_to_error"] = rays;
        json["seconds_to_error"] = rays * pair.trace_seconds / pair.rays;
    } else {
        json["rays_to_error"] = nullptr;
        json["seconds_to_error"] = nullptr;
    }
    json["by_depth"] = Json::array();
    for (std::size_t s = 0; s < kSlices; ++s) {
        const Sums& sums = slice[s];
        const double step = height / kSlices;
        json["by_depth"].push_back(Json{{"z_low", box.min.z() + static_cast<double>(s) * step},
                                        {"z_high", box.min.z() + static_cast<double>(s + 1) * step},
                                        {"flux", sums.area > 0.0 ? sums.flux / sums.area : 0.0},
                                        {"bias", sums.relative(sums.bias)},
                                        {"noise", sums.relative(0.5 * sums.spread)}});
    }
    return json;
}

}  // namespace sidewall::app
