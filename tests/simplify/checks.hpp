#pragma once
#include <catch2/catch.hpp>
#include <cstring>
#include <set>

#include "simplify/simplify.hpp"
#include "surface/topology.hpp"
#include "test_meshes.hpp"

namespace sidewall::test {

inline bool same_bits(const Vec3& a, const Vec3& b) {
    return std::memcmp(a.data(), b.data(), 3 * sizeof(double)) == 0;
}

inline bool same_bits(const TriangleMesh& a, const TriangleMesh& b) {
    return a.vertices.size() == b.vertices.size() && a.triangles == b.triangles &&
           std::equal(a.vertices.begin(), a.vertices.end(), b.vertices.begin(),
                      [](const Vec3& p, const Vec3& q) { return same_bits(p, q); });
}

struct Lexicographic {
    bool operator()(const Vec3& a, const Vec3& b) const {
        return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
    }
};
using Places = std::set<Vec3, Lexicographic>;

inline Places places(const TriangleMesh& mesh) {
    return {mesh.vertices.begin(), mesh.vertices.end()};
}

/// Number of triangles whose normal points into the material.
inline std::size_t flipped(const TriangleMesh& mesh, const Field& field) {
    std::size_t count = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Vec3 p = triangle_centroid(mesh, t), n = area_vector(mesh, t).normalized() * 1e-3;
        count += !(field(p + n) > field(p - n));
    }
    return count;
}

/// Requires a manifold, oriented mesh of the same topology with no more degenerate or duplicate triangles.
inline void require_same_kind(const TriangleMesh& before, const TriangleMesh& after) {
    const surface::Topology a = surface::analyse_topology(before), b = surface::analyse_topology(after);
    REQUIRE(b.manifold());
    REQUIRE(b.oriented());
    REQUIRE(b.euler() == a.euler());
    REQUIRE(b.components == a.components);
    REQUIRE(b.boundary_loops.size() == a.boundary_loops.size());
    REQUIRE(b.degenerate_triangles <= a.degenerate_triangles);
    REQUIRE(b.duplicate_triangles <= a.duplicate_triangles);
    REQUIRE(b.isolated_vertices == 0);
}

}  // namespace sidewall::test
