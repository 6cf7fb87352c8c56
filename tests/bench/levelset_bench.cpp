// CPU microseconds a surface point (voxel with |phi| <= dx/2) of one time step on a sphere, by phase and
// scheme; the extraction rate; and the time of sharp edges over that of plain marching cubes. Usage:
// levelset_bench [RADIUS in dx, 282 = 1 M points] [TIME_STEPS]
#include <fmt/format.h>
#include <tbb/tick_count.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "levelset/layers/make_stack.hpp"
#include "levelset/meshes/extract.hpp"
#include "levelset/motion/advection.hpp"
#include "levelset/openvdb_grid.hpp"
#include "tests/bench/measure.hpp"

using namespace sidewall;
using namespace sidewall::levelset;
using bench::cpu_seconds;
using bench::median;

int main(int argc, char** argv) {
    const double radius = argc > 1 ? std::atof(argv[1]) : 282.0;
    const int time_steps = argc > 2 ? std::atoi(argv[2]) : 6;
    const double side = 2.0 * std::ceil(radius + 0.5 * time_steps + 6.0);
    const Domain domain = make_domain({side, side}, 1.0, {Side::reflective, Side::reflective});
    const struct {
        const char* name;
        Scheme scheme;
    } rows[] = {
        {"engquist_osher", Scheme::engquist_osher}, {"weno3", Scheme::weno3}, {"weno5", Scheme::weno5}};
    fmt::print("{:<16}{:>9}{:>9}{:>9}{:>9}{:>9}{:>12}{:>8}{:>10}{:>10}\n", "Euler, cfl 0.5", "points",
               "extend", "speeds", "move", "sum", "Mtri/s wall", "sharp", "mean err", "std dev");
    for (const auto& row : rows) {
        MaterialStack stack{
            domain,
            {{0, sample_grid(
                     domain, [=](const Vec3& p) { return p.norm() - radius; }, -radius - 5, radius + 5)}}};
        std::size_t points = 0;
        for (auto it = stack.top().cbeginValueOn(); it; ++it) points += std::abs(*it) <= 0.5f;
        std::vector<double> extend_times, speed_times, move_times, sums, rates, sharp;
        for (int n = 0; n < time_steps; ++n) {
            const tbb::tick_count extract_start = tbb::tick_count::now();
            const TriangleMesh mesh = extract_surface(stack.top(), domain);
            rates.push_back(static_cast<double>(mesh.triangles.size()) /
                            (tbb::tick_count::now() - extract_start).seconds() / 1e6);
            const std::vector<float> speed(mesh.vertices.size(), 1.0f);  // at the mesh's vertices
            const tbb::tick_count sharp_start = tbb::tick_count::now();
            extract_surface(stack.top(), domain, surface::SharpEdges::all);
            sharp.push_back((tbb::tick_count::now() - sharp_start).seconds() /
                            (sharp_start - extract_start).seconds());
            const surface::RayScene scene(mesh);  // counted with the flux calculation, not here
            const double t0 = cpu_seconds();
            Extension extension = extend(stack.top(), domain, scene);
            const double t1 = cpu_seconds();
            find_bodies(stack, extension);
            Motion motion{std::move(extension), {}};
            motion.law.speed = [&](std::size_t k, std::size_t, const Vec3&) {
                const SurfaceSample& s = motion.extension.samples[k];
                const auto [a, b, c] = mesh.triangles[s.triangle];
                return static_cast<double>((1.0f - s.u - s.v) * speed[a] + s.u * speed[b] + s.v * speed[c]);
            };
            const double dt = 0.5 / max_speed(stack, motion);
            const double t2 = cpu_seconds();
            advect(stack, motion, dt, {row.scheme, TimeIntegration::euler, 0.5});
            const double t3 = cpu_seconds();
            const double scale = 1e6 / static_cast<double>(points);
            extend_times.push_back((t1 - t0) * scale);
            speed_times.push_back((t2 - t1) * scale);
            move_times.push_back((t3 - t2) * scale);
            sums.push_back((t3 - t0) * scale);
        }
        const TriangleMesh mesh = extract_surface(stack.top(), domain);
        double mean = 0.0, squares = 0.0;
        for (const Vec3& p : mesh.vertices) {
            const double d = p.norm() - radius - 0.5 * time_steps;
            mean += d / static_cast<double>(mesh.vertices.size());
            squares += d * d / static_cast<double>(mesh.vertices.size());
        }
        fmt::print("{:<16}{:>9}{:>9.3f}{:>9.3f}{:>9.3f}{:>9.3f}{:>12.2f}{:>8.2f}{:>10.5f}{:>10.5f}\n",
                   row.name, points, median(extend_times), median(speed_times), median(move_times),
                   median(sums), median(rates), median(sharp), mean,
                   std::sqrt(std::max(0.0, squares - mean * mean)));
    }
    fmt::print(
        "CPU us a surface point a time step (all threads together), median of {} time steps; errors in dx after {} dx "
        "of growth\n",
        time_steps, 0.5 * time_steps);
}
