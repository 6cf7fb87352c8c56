#include "levelset/meshes/voids.hpp"

#include <algorithm>
#include <limits>

#include "surface/ray_scene.hpp"

namespace sidewall::levelset {

std::vector<std::uint8_t> sealed_off(const TriangleMesh& surface, std::vector<SurfacePiece> pieces,
                                     const Domain& domain) {
    if (std::none_of(pieces.begin(), pieces.end(), [](const SurfacePiece& p) { return p.shuts_in(); }))
        return {};
    const std::vector<std::uint32_t> part = piece_of_vertices(surface, domain);
    constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::uint32_t> flattest(part.size(), kNone);  // triangle around each vertex
    for (std::uint32_t t = 0; t < surface.triangles.size(); ++t)
        for (const std::uint32_t v : surface.triangles[t])
            if (flattest[v] == kNone || area_vector(surface, t).z() > area_vector(surface, flattest[v]).z())
                flattest[v] = t;

    // A body that lies in the gas has gas above it, which may be a void's.
    const surface::RayScene scene(surface);
    std::stable_sort(pieces.begin(), pieces.end(), [&](const SurfacePiece& a, const SurfacePiece& b) {
        return surface.vertices[a.top].z() > surface.vertices[b.top].z();
    });
    std::vector<std::uint8_t> sealed(part.size(), 0);  // by part
    for (const SurfacePiece& piece : pieces) {
        if (piece.shuts_in()) {
            sealed[piece.part] = 1;
            continue;
        }
        // From inside a triangle: the top itself may lie on a side, where no surface is met for sure.
        const auto above = scene.closest_hit(triangle_centroid(surface, flattest[piece.top]), Vec3::UnitZ(),
                                             1e-2 * domain.spacing, std::numeric_limits<double>::infinity());
        if (above) sealed[piece.part] = sealed[part[surface.triangles[above.triangle][0]]];
    }
    std::vector<std::uint8_t> result;
    for (const Triangle& t : surface.triangles) result.push_back(sealed[part[t[0]]]);
    return result;
}

}  // namespace sidewall::levelset
