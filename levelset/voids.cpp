#include "levelset/voids.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "surface/disjoint_sets.hpp"
#include "surface/ray_scene.hpp"

namespace sidewall::levelset {
namespace {

// The vertex that stands for each vertex's piece of the surface.
std::vector<std::uint32_t> pieces_of(const TriangleMesh& surface, const Domain& domain) {
    const auto count = static_cast<std::uint32_t>(surface.vertices.size());
    surface::DisjointSets sets(count);
    for (const auto& [a, b, c] : surface.triangles) {
        sets.join(a, b);
        sets.join(b, c);
    }
    for (int axis = 0; axis < 2; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        if (domain.side[a] != Side::periodic) continue;
        // What lies on one side repeats what lies on the other.
        const auto place = [&](const Vec3& p) {
            const double unit = 1e-5 * domain.spacing;
            return std::array{std::llround(p[1 - axis] / unit), std::llround(p.z() / unit)};
        };
        std::map<std::array<long long, 2>, std::uint32_t> low;
        for (std::uint32_t v = 0; v < count; ++v)
            if (surface.vertices[v][axis] == domain.min[a]) low.emplace(place(surface.vertices[v]), v);
        for (std::uint32_t v = 0; v < count; ++v) {
            if (surface.vertices[v][axis] != domain.max[a]) continue;
            if (const auto same = low.find(place(surface.vertices[v])); same != low.end())
                sets.join(v, same->second);
        }
    }
    std::vector<std::uint32_t> piece(count);
    for (std::uint32_t v = 0; v < count; ++v) piece[v] = sets.root(v);
    return piece;
}

}  // namespace

std::vector<std::uint8_t> sealed_off(const TriangleMesh& surface, const Domain& domain) {
    const std::vector<std::uint32_t> piece = pieces_of(surface, domain);
    constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::uint32_t> summit(piece.size(), kNone);  // the highest vertex of each piece
    std::vector<std::uint32_t> pieces;
    for (const Triangle& t : surface.triangles)
        for (const std::uint32_t v : t) {
            std::uint32_t& highest = summit[piece[v]];
            if (highest == kNone) pieces.push_back(piece[v]);
            if (highest == kNone || surface.vertices[v].z() > surface.vertices[highest].z()) highest = v;
        }
    if (pieces.size() < 2) return {};
    std::vector<double> faces_up(piece.size(), 0.0);           // around each vertex
    std::vector<std::uint32_t> flattest(piece.size(), kNone);  // triangle around it
    for (std::uint32_t t = 0; t < surface.triangles.size(); ++t)
        for (const std::uint32_t v : surface.triangles[t]) {
            const double up = area_vector(surface, t).z();
            faces_up[v] += up;
            if (flattest[v] == kNone || up > area_vector(surface, flattest[v]).z()) flattest[v] = t;
        }

    // A void has its ceiling at the top; a body that lies in the gas has gas above it, which may be a void's.
    const surface::RayScene scene(surface);
    std::stable_sort(pieces.begin(), pieces.end(), [&](std::uint32_t a, std::uint32_t b) {
        return surface.vertices[summit[a]].z() > surface.vertices[summit[b]].z();
    });
    std::vector<std::uint8_t> sealed(piece.size(), 0);  // by piece
    bool any = false;
    for (const std::uint32_t p : pieces) {
        if (faces_up[summit[p]] < 0.0) {
            sealed[p] = 1;
        } else {
            // From inside a triangle: the summit itself may lie on a side, where no surface is met for sure.
            const auto above =
                scene.closest_hit(triangle_centroid(surface, flattest[summit[p]]), Vec3::UnitZ(),
                                  1e-2 * domain.spacing, std::numeric_limits<double>::infinity());
            if (above) sealed[p] = sealed[piece[surface.triangles[above.triangle][0]]];
        }
        any = any || sealed[p] != 0;
    }
    if (!any) return {};
    std::vector<std::uint8_t> result;
    for (const Triangle& t : surface.triangles) result.push_back(sealed[piece[t[0]]]);
    return result;
}

}  // namespace sidewall::levelset
