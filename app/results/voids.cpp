#include "app/results/voids.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "surface/infinity.hpp"

namespace sidewall::app {
namespace {

// Length of a void along an axis: of all its parts, which periodic sides may have cut.
double length_along(const std::vector<Box3>& boxes, int axis) {
    Stretches parts;
    for (const Box3& box : boxes) parts.emplace_back(box.min[axis], box.max[axis]);
    std::sort(parts.begin(), parts.end());
    double length = 0.0, reached = -kInfinity;
    for (const auto& [from, to] : parts) {
        length += std::max(0.0, to - std::max(from, reached));
        reached = std::max(reached, to);
    }
    return length;
}

// Whether a void goes on in its image beyond one of an axis's sides. From side to side it is as long as the
// domain.
bool is_mirrored(const std::vector<Box3>& boxes, int axis, const levelset::Domain& domain) {
    const auto a = static_cast<std::size_t>(axis);
    if (domain.side[a] != levelset::Side::reflective) return false;
    const double near = 1e-6 * domain.spacing;
    const auto at = [&](auto&& touches) { return std::any_of(boxes.begin(), boxes.end(), touches); };
    return at([&](const Box3& box) { return box.min[axis] <= domain.min[a] + near; }) !=
           at([&](const Box3& box) { return box.max[axis] >= domain.max[a] - near; });
}

}  // namespace

Voids voids_in(const TriangleMesh& surface, const std::vector<levelset::SurfacePiece>& pieces,
               const levelset::Domain& domain, const Vec3& along) {
    Voids voids;
    const int across = std::abs(along.x()) > 0.5 ? 0 : 1;
    const double cell = std::pow(domain.spacing, 3);
    for (const levelset::SurfacePiece& piece : pieces) {
        if (piece.cover != 0 || -piece.volume < cell) continue;
        ++voids.count;
        voids.volume -= piece.volume;
        const std::array mirrored{is_mirrored(piece.boxes, 0, domain), is_mirrored(piece.boxes, 1, domain)};
        voids.whole_volume -= piece.volume * (mirrored[0] ? 2.0 : 1.0) * (mirrored[1] ? 2.0 : 1.0);
        voids.top = std::fmax(voids.top, surface.vertices[piece.top].z());
        const double once = length_along(piece.boxes, across);
        voids.width = std::fmax(voids.width, mirrored[static_cast<std::size_t>(across)] ? 2.0 * once : once);
    }
    return voids;
}

std::optional<TriangleMesh> open_surface(const TriangleMesh& surface,
                                         const std::vector<levelset::SurfacePiece>& pieces,
                                         const levelset::Domain& domain) {
    const auto sealed = levelset::sealed_off(surface, pieces, domain);
    if (sealed.empty()) return std::nullopt;
    TriangleMesh open;
    open.vertices = surface.vertices;
    for (std::size_t t = 0; t < sealed.size(); ++t)
        if (sealed[t] == 0) open.triangles.push_back(surface.triangles[t]);
    return open;
}

}  // namespace sidewall::app
