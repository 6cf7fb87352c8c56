// Lindstrom-Turk and region simplification of one dense trench at equal numbers of vertices: time against
// error. Usage: simplify_bench [GRID_SPACING] [ROUGHNESS], both lengths, the latter in grid spacings (default
// 0.12 0.03).
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>

#include "simplify/lindstrom_turk.hpp"
#include "simplify/region.hpp"
#include "surface/curvature.hpp"
#include "surface/distance.hpp"
#include "surface/quality.hpp"
#include "tests/simplify/test_meshes.hpp"

using namespace sidewall;

namespace {

/// CPU seconds: the collapse runs on one thread, and shared cores do not spoil the ratios.
double now() {
    return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

}  // namespace

int main(int argc, char** argv) {
    const double dx = argc > 1 ? std::atof(argv[1]) : 0.12;
    const double roughness = argc > 2 ? std::atof(argv[2]) : 0.03;
    if (!(dx > 0.0) || !(roughness >= 0.0)) {
        fmt::print(stderr, "simplify_bench: the grid spacing must be positive, the roughness not negative\n");
        return 2;
    }
    const TriangleMesh mesh = test::trench_mesh(dx, roughness);
    double start = now();
    const auto features = surface::feature_flags(mesh, dx);
    fmt::print("trench: {} vertices, {} features (C = 0.5, {:.3f} s), dx {}, roughness {} dx, {} slivers\n",
               mesh.vertices.size(), std::count(features.begin(), features.end(), 1), now() - start, dx,
               roughness, surface::measure_quality(mesh).slivers);
    fmt::print("Distances in dx, vertices to surface; slivers: an angle below 5 degrees.\n\n");
    fmt::print("{:<28} {:>8} {:>9} {:>8} {:>9} {:>9} {:>9} {:>9} {:>15}\n", "method", "removed", "vertices",
               "CPU s", "to: max", "mean", "back: max", "mean", "slivers");

    const auto row = [&](const std::string& name, auto&& simplify) {
        start = now();
        const simplify::Result result = simplify();
        const double seconds = now() - start;
        const auto distance = surface::two_sided_distance(mesh, result.mesh);
        const auto quality = surface::measure_quality(result.mesh);
        const auto left = result.mesh.vertices.size();
        fmt::print("{:<28} {:>6.1f} % {:>9} {:>8.3f} {:>9.4f} {:>9.5f} {:>9.4f} {:>9.5f} {:>7}/{}\n", name,
                   100.0 * (1.0 - double(left) / double(mesh.vertices.size())), left, seconds,
                   distance.forward.max / dx, distance.forward.mean / dx, distance.backward.max / dx,
                   distance.backward.mean / dx, quality.slivers, result.mesh.triangles.size());
        std::fflush(stdout);
    };
    for (const double removed : {0.5, 0.7, 0.9}) {
        const auto target = std::size_t((1.0 - removed) * double(mesh.vertices.size()));
        for (const auto& [name, weights] :
             {std::pair{"0.5/0.5/0", simplify::kVolumeWeights}, {"0.4/0.3/0.3", simplify::kShapeWeights}}) {
            row(fmt::format("lindstrom-turk {}", name), [&] {
                return simplify::simplify_lindstrom_turk(mesh,
                                                         {.target_vertices = target, .weights = weights});
            });
            for (const double l0 : {0.0, 0.5 * dx, dx})
                row(fmt::format("region l0={} {}",
                                l0 == 0.0 ? "0"
                                : l0 < dx ? "dx/2"
                                          : "dx",
                                name),
                    [&] {
                        const double step = l0 > 0.0 ? l0 : dx;
                        return simplify::simplify_regions(mesh, features,
                                                          {.l0 = l0,
                                                           .step = step,
                                                           .l_max = 0.0,
                                                           .target_vertices = target,
                                                           .weights = weights});
                    });
        }
        fmt::print("\n");
    }
    for (const double l_max : {2.0, 3.0, 5.0})
        row(fmt::format("region l0=dx l_max={}dx", l_max), [&] {
            return simplify::simplify_regions(mesh, features, {.l0 = dx, .step = dx, .l_max = l_max * dx});
        });
}
