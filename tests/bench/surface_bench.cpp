// Seconds and throughput of the surface folder's work on one mesh: a rippled plane of the size given (default
// 400: 320 k triangles). Compare ratios, not seconds.
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <functional>

#include "surface/curvature.hpp"
#include "surface/cut.hpp"
#include "surface/distance.hpp"
#include "surface/files/mesh_io.hpp"
#include "surface/files/ply.hpp"
#include "surface/files/vtp.hpp"
#include "surface/quality.hpp"
#include "surface/topology.hpp"

using namespace sidewall;

namespace {

TriangleMesh rippled_plane(std::uint32_t n, double shift) {
    TriangleMesh mesh;
    for (std::uint32_t j = 0; j <= n; ++j)
        for (std::uint32_t i = 0; i <= n; ++i) {
            const double x = double(i) / n, y = double(j) / n;
            mesh.vertices.emplace_back(x, y, 0.1 * std::sin(17 * x) * std::cos(13 * y) + shift);
        }
    for (std::uint32_t j = 0; j < n; ++j)
        for (std::uint32_t i = 0; i < n; ++i) {
            const std::uint32_t a = j * (n + 1) + i, c = a + n + 1;
            mesh.triangles.push_back({a, a + 1, c + 1});
            mesh.triangles.push_back({a, c + 1, c});
        }
    return mesh;
}

void measure(const char* what, std::size_t triangles, const std::function<void()>& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    fmt::print("{:<28} {:>8.3f} s {:>10.2f} M triangles/s\n", what, seconds,
               1e-6 * double(triangles) / seconds);
}

}  // namespace

int main(int argc, char** argv) {
    const auto n = std::uint32_t(std::max(2, argc > 1 ? std::atoi(argv[1]) : 400));
    const TriangleMesh mesh = rippled_plane(n, 0.0), near = rippled_plane(n, 0.1 / n),
                       far = rippled_plane(n, 0.2);
    const std::size_t size = mesh.triangles.size();
    fmt::print("{} triangles\n", size);
    std::string vtp, ply;
    measure("encode VTP (zlib)", size, [&] { vtp = surface::encode_vtp(mesh); });
    measure("decode VTP", size, [&] { surface::decode_vtp(vtp, "memory"); });
    measure("encode PLY", size, [&] { ply = surface::encode_ply(mesh); });
    measure("decode PLY", size, [&] { surface::decode_ply(ply, "memory"); });
    measure("topology", size, [&] { surface::analyse_topology(mesh); });
    measure("quality", size, [&] { surface::measure_quality(mesh); });
    measure("curvature", size, [&] { surface::mesh_curvature(mesh); });
    measure("two-sided distance, near", size, [&] { surface::two_sided_distance(mesh, near); });
    measure("two-sided distance, far", size, [&] { surface::two_sided_distance(mesh, far); });
    measure("cut by a plane", size, [&] { surface::cut_by_plane(mesh, {Vec3::UnitY(), 0.5}); });
    fmt::print("bytes a triangle: VTP {:.1f}, PLY {:.1f}\n", double(vtp.size()) / double(size),
               double(ply.size()) / double(size));
}
