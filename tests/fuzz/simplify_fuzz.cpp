// For libFuzzer: turns bytes into a mesh and options. Every method either refuses them with a message or
// keeps its promises. Build and run as tests/fuzz/CMakeLists.txt says.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>

#include "simplify/simplify.hpp"
#include "surface/distance.hpp"
#include "surface/error.hpp"
#include "surface/topology.hpp"

using namespace sidewall;

namespace {

class Bytes {
  public:
    Bytes(const std::uint8_t* data, std::size_t size) : rest_(data, size) {}
    std::uint8_t next() {
        if (rest_.empty()) return 0;
        const std::uint8_t byte = rest_.front();
        rest_ = rest_.subspan(1);
        return byte;
    }
    /// The next byte as a number in [0, 1].
    double share() { return next() / 255.0; }
    bool empty() const { return rest_.empty(); }

  private:
    std::span<const std::uint8_t> rest_;
};

void expect(bool holds, const char* promise) {
    if (holds) return;
    std::fprintf(stderr, "broken promise: %s\n", promise);
    std::abort();
}

/// An open sheet of n x n cells, a tube or a torus; the bytes move its vertices and leave out some triangles.
TriangleMesh sheet(Bytes& bytes) {
    const std::uint32_t n = 3 + bytes.next() % 14, kind = bytes.next() % 3;
    const bool closed_x = kind > 0, closed_y = kind > 1;
    const double roughness = bytes.next() % 4 == 0 ? 0.0 : 2.0 * bytes.share();
    const std::uint32_t nx = closed_x ? n : n + 1, ny = closed_y ? n : n + 1;
    TriangleMesh mesh;
    for (std::uint32_t j = 0; j < ny; ++j)
        for (std::uint32_t i = 0; i < nx; ++i) {
            const double u = 6.283185307179586 * i / n, v = 6.283185307179586 * j / n;
            Vec3 p(i, j, 0.0);
            if (kind == 1) p = Vec3(std::cos(u), std::sin(u), 0.3 * j) * (0.2 * n);
            if (kind == 2)
                p = Vec3((2 + std::cos(v)) * std::cos(u), (2 + std::cos(v)) * std::sin(u), std::sin(v)) *
                    (0.2 * n);
            p += roughness * Vec3(bytes.share() - 0.5, bytes.share() - 0.5, bytes.share() - 0.5);
            mesh.vertices.push_back(p);
        }
    const auto at = [&](std::uint32_t i, std::uint32_t j) { return j % ny * nx + i % nx; };
    for (std::uint32_t j = 0; j < n; ++j)
        for (std::uint32_t i = 0; i < n; ++i) {
            const std::uint8_t choice = bytes.next();
            const std::uint32_t a = at(i, j), b = at(i + 1, j), c = at(i + 1, j + 1), d = at(i, j + 1);
            if (choice % 16 == 1) continue;
            if (choice & 16) {
                mesh.triangles.push_back({a, b, c});
                if (choice % 16 != 2) mesh.triangles.push_back({a, c, d});
            } else {
                mesh.triangles.push_back({a, b, d});
                if (choice % 16 != 2) mesh.triangles.push_back({b, c, d});
            }
        }
    return mesh;
}

/// Triangles of arbitrary indices, nearly always refused.
TriangleMesh soup(Bytes& bytes) {
    TriangleMesh mesh;
    const std::uint32_t vertices = bytes.next() % 24, triangles = bytes.next() % 32;
    for (std::uint32_t v = 0; v < vertices; ++v)
        mesh.vertices.emplace_back(bytes.next() % 8, bytes.next() % 8, bytes.next() % 8);
    for (std::uint32_t t = 0; t < triangles; ++t)
        mesh.triangles.push_back({bytes.next() % 24u, bytes.next() % 24u, bytes.next() % 24u});
    return mesh;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Bytes bytes(data, size);
    constexpr simplify::Method kMethods[] = {simplify::Method::lindstrom_turk, simplify::Method::region,
                                             simplify::Method::region_bounded};
    simplify::Options options;
    options.method = kMethods[bytes.next() % 3];
    const std::uint8_t choice = bytes.next();
    if (choice & 1) options.target_vertices = 1 + bytes.next();
    if (choice & 2) options.max_error = 0.001 + bytes.share();
    if (choice & 4) options.weights = simplify::Weights{0.01 + bytes.share(), bytes.share(), bytes.share()};
    if (choice & 8) options.l0 = 3.0 * bytes.share();
    if (choice & 16) options.step = 0.1 + 3.0 * bytes.share();
    TriangleMesh mesh = choice & 32 ? soup(bytes) : sheet(bytes);
    std::vector<std::uint8_t> features(mesh.vertices.size(), 0);
    if (choice & 64)
        for (auto& f : features) f = bytes.next() % 4 == 0;
    if (choice & 128) {
        Attribute material{"material", 1, Scalar::int32, {}};
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) material.values.push_back(bytes.next() % 3);
        mesh.triangle_attributes.push_back(material);
    }
    try {
        const TriangleMesh result = simplify::simplify(mesh, features, options).mesh;
        if (mesh.triangles.empty()) return 0;
        const surface::Topology before = surface::analyse_topology(mesh),
                                after = surface::analyse_topology(result);
        expect(after.manifold(), "manifold");
        expect(after.oriented(), "oriented");
        expect(after.euler() == before.euler(), "Euler number");
        expect(after.components == before.components, "components");
        expect(after.boundary_loops.size() == before.boundary_loops.size(), "boundary loops");
        expect(after.degenerate_triangles <= before.degenerate_triangles, "no new degenerate triangle");
        expect(after.duplicate_triangles <= before.duplicate_triangles, "no new duplicate triangle");
        const Box3 box = bounding_box(mesh);
        for (const Vec3& p : result.vertices)
            expect(p.cwiseMax(box.min).cwiseMin(box.max) == p, "inside the box");
        if (options.max_error)
            expect(surface::two_sided_distance(mesh, result).max <= *options.max_error * (1.0 + 1e-9),
                   "error bound");
    } catch (const GeometryError&) {
    } catch (const RecipeError&) {
    }
    return 0;
}
