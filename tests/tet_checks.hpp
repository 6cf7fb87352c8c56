#pragma once
#include <algorithm>
#include <catch2/catch.hpp>
#include <utility>
#include <vector>

#include "surface/tetrahedra/tet_mesh.hpp"

// Checks that every mesh of tetrahedra must pass.
namespace sidewall::test {

using Sorted = std::array<std::uint32_t, 3>;

/// A face and the regions of the tetrahedra that have it.
struct FaceAt {
    Sorted face;
    std::vector<int> regions;
};

/// All faces, in the lexicographic order of their sorted vertices.
inline std::vector<FaceAt> faces_of(const TetMesh& mesh) {
    std::vector<std::pair<Sorted, int>> all;
    all.reserve(4 * mesh.tetrahedra.size());
    for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
        Tetrahedron corners = mesh.tetrahedra[t];
        std::sort(corners.begin(), corners.end());
        const auto [a, b, c, d] = corners;
        for (const Sorted& face : {Sorted{b, c, d}, Sorted{a, c, d}, Sorted{a, b, d}, Sorted{a, b, c}})
            all.emplace_back(face, mesh.region[t]);
    }
    std::sort(all.begin(), all.end());
    std::vector<FaceAt> faces;
    for (const auto& [face, region] : all) {
        if (faces.empty() || faces.back().face != face) faces.push_back({face, {}});
        faces.back().regions.push_back(region);
    }
    return faces;
}

/// Checks that tetrahedra have positive volumes and dihedral angles over 5 degrees, and that each face
/// belongs to two of them, or to one and then lies on the box to the last bit or, if \p open, on the surface.
/// \returns the number of faces on the surface.
inline std::size_t check_tets(const TetMesh& mesh, const Box3& box, bool open) {
    const TetQuality quality = measure_tets(mesh);
    CHECK(quality.inverted == 0);
    CHECK(quality.least_dihedral_deg > 5.0);
    std::size_t shared_by_more = 0, inside = 0;
    for (const auto& [face, regions] : faces_of(mesh)) {
        if (regions.size() > 2) ++shared_by_more;
        if (regions.size() != 1) continue;
        bool on_box = false;
        for (int axis = 0; axis < 3; ++axis)
            for (const double plane : {box.min[axis], box.max[axis]})
                on_box = on_box ||
                         std::all_of(face.begin(), face.end(), [&, a = axis, p = plane](std::uint32_t v) {
                             return mesh.vertices[v][a] == p;
                         });
        if (!on_box) ++inside;
    }
    CHECK(shared_by_more == 0);
    CHECK((open || inside == 0));
    for (const Vec3& p : mesh.vertices) {
        REQUIRE((p.array() >= box.min.array()).all());
        REQUIRE((p.array() <= box.max.array()).all());
    }
    return inside;
}

}  // namespace sidewall::test
