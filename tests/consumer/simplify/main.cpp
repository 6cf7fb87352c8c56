// Coarsens a flat square of 2 * 20 * 20 triangles: being flat, it needs no inner vertices.
#include <cstdio>

#include "simplify/simplify.hpp"

int main() {
    constexpr std::uint32_t n = 20;
    sidewall::TriangleMesh mesh;
    for (std::uint32_t j = 0; j <= n; ++j)
        for (std::uint32_t i = 0; i <= n; ++i) mesh.vertices.emplace_back(i, j, 0.0);
    for (std::uint32_t j = 0; j < n; ++j)
        for (std::uint32_t i = 0; i < n; ++i) {
            const std::uint32_t a = j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
            mesh.triangles.push_back({a, b, d});
            mesh.triangles.push_back({a, d, c});
        }
    sidewall::simplify::Options options;
    options.method = sidewall::simplify::Method::lindstrom_turk;
    options.target_vertices = 50;
    options.max_error = 1e-6;
    const auto result = sidewall::simplify::simplify(mesh, {}, options);
    std::printf("%zu vertices of %zu\n", result.mesh.vertices.size(), mesh.vertices.size());
    return result.mesh.vertices.size() <= 50 && sidewall::total_area(result.mesh) > n * n - 1e-6 ? 0 : 1;
}
