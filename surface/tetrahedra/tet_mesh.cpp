#include "surface/tetrahedra/tet_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>

namespace sidewall {

double tet_volume(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    return (b - a).cross(c - a).dot(d - a) / 6.0;
}

double smallest_dihedral_cosine(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    const Vec3 ab = b - a, ac = c - a, ad = d - a, bc = c - b, bd = d - b;
    // Normals out of the faces opposite to a, b, c and d.
    const Vec3 n[4] = {bc.cross(bd), ad.cross(ac), ab.cross(ad), ac.cross(ab)};
    if (!(-n[3].dot(ad) > 0.0)) return 2.0;
    double squared[4];
    for (int i = 0; i < 4; ++i) squared[i] = n[i].squaredNorm();
    double widest = -1.0;
    for (int i = 0; i < 4; ++i)
        for (int j = i + 1; j < 4; ++j)
            widest = std::max(widest, -n[i].dot(n[j]) / std::sqrt(squared[i] * squared[j]));
    return std::isfinite(widest) ? widest : 2.0;
}

std::vector<TetFace> sorted_faces(const std::vector<Tetrahedron>& tetrahedra,
                                  const std::function<int(std::uint32_t)>& region_of) {
    constexpr std::size_t kFaces[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
    std::vector<TetFace> faces;
    faces.reserve(4 * tetrahedra.size());
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
        const Tetrahedron& tet = tetrahedra[t];
        const int region = region_of(t);
        for (const auto& [a, b, c] : kFaces) {
            if (region < 0) continue;
            TetFace& face = faces.emplace_back(TetFace{{}, {tet[a], tet[b], tet[c]}, region});
            face.sorted = face.corners;
            std::ranges::sort(face.sorted);
        }
    }
    std::ranges::sort(faces, [](const TetFace& p, const TetFace& q) {
        return std::tie(p.sorted, p.region) < std::tie(q.sorted, q.region);
    });
    return faces;
}

TetQuality measure_tets(const TetMesh& mesh) {
    TetQuality quality;
    quality.volume.assign(mesh.regions.size(), 0.0);
    quality.count.assign(mesh.regions.size(), 0);
    quality.least_dihedral_deg = 180.0;
    quality.shortest_edge = kInfinity;
    constexpr double kDegrees = 180.0 / std::numbers::pi;
    double sum = 0.0;
    for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
        std::array<Vec3, 4> p;
        for (std::size_t k = 0; k < 4; ++k) p[k] = mesh.vertices[mesh.tetrahedra[t][k]];
        const double cosine = smallest_dihedral_cosine(p[0], p[1], p[2], p[3]);
        const double angle = cosine > 1.0 ? 0.0 : kDegrees * std::acos(cosine);
        if (cosine > 1.0) ++quality.inverted;
        quality.least_dihedral_deg = std::min(quality.least_dihedral_deg, angle);
        sum += angle;
        const auto region = static_cast<std::size_t>(mesh.region[t]);
        quality.volume[region] += tet_volume(p[0], p[1], p[2], p[3]);
        ++quality.count[region];
        for (std::size_t i = 0; i < 4; ++i)
            for (std::size_t j = i + 1; j < 4; ++j) {
                const double length = (p[i] - p[j]).norm();
                quality.longest_edge = std::max(quality.longest_edge, length);
                quality.shortest_edge = std::min(quality.shortest_edge, length);
            }
    }
    quality.mean_least_dihedral_deg =
        sum / static_cast<double>(std::max<std::size_t>(1, mesh.tetrahedra.size()));
    return quality;
}

}  // namespace sidewall
