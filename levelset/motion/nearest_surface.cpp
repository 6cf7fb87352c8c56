#include "levelset/motion/nearest_surface.hpp"

#include <tbb/task_arena.h>

#include "levelset/openvdb_grid.hpp"

namespace sidewall::levelset {
namespace {

// Whether a node shifted by periods lies within reach of the domain, shifted along periodic axes alone. Along
// those of a cell or two the surface is everywhere the same.
bool is_image(const Domain& domain, const openvdb::Coord& node, const openvdb::Coord& shifted) {
    constexpr int kReach = 2;
    for (const int axis : {0, 1}) {
        const auto a = static_cast<std::size_t>(axis);
        const bool may = domain.side[a] == Side::periodic && domain.cells[a] > kReach &&
                         shifted[axis] >= -kReach && shifted[axis] <= domain.cells[a] + kReach;
        if (shifted[axis] != node[axis] && !may) return false;
    }
    return true;
}

}  // namespace

surface::SurfaceHit NearestSurface::closest(const CellTriangles& cells, const Domain& domain,
                                            const openvdb::Coord& node, Vec3& world) const {
    surface::SurfaceHit best = near(cells, node, world, domain.spacing);
    const Vec3 own = world;
    for (int image = 1; image < 9; ++image) {
        openvdb::Coord shifted = node;
        Vec3 from = own;
        for (const int axis : {0, 1}) {
            const auto a = static_cast<std::size_t>(axis);
            const int periods = (image / (axis == 0 ? 1 : 3) + 1) % 3 - 1;
            shifted[axis] += periods * domain.cells[a];
            from[axis] += periods * (domain.max[a] - domain.min[a]);
        }
        if (!is_image(domain, node, shifted)) continue;
        const surface::SurfaceHit hit = near(cells, shifted, from, domain.spacing);
        if (hit && (!best || hit.distance < best.distance)) best = hit, world = from;
    }
    if (best) return best;
    // Isolated: a thread that waits for the hierarchy's own tasks must not come back here with another node.
    if (scene_ == nullptr)
        std::call_once(once_, [&] { tbb::this_task_arena::isolate([&] { own_scene_.emplace(*mesh_); }); });
    return (scene_ != nullptr ? *scene_ : *own_scene_).closest_point(world, 1e30);
}

// Nothing if the surface is two cells away or more.
surface::SurfaceHit NearestSurface::near(const CellTriangles& cells, const openvdb::Coord& node,
                                         const Vec3& world, double dx) const {
    constexpr double kSure = 0.99, kFar = 1.99;  // dx; the margins are for rounding
    surface::SurfaceHit best;
    // All points less than a cell away lie in the cells around the node.
    best.distance = kSure * dx;
    cells.each_around(node, [&](std::uint32_t t) { keep_nearer(t, world, best); });
    if (best) return best;
    best.distance = kFar * dx;
    cells.each_in_leaves(node, 2, [&](std::uint32_t t) { keep_nearer(t, world, best); });
    return best;
}

// Ties go to the lowest triangle.
void NearestSurface::keep_nearer(std::uint32_t t, const Vec3& world, surface::SurfaceHit& best) const {
    const auto [a, b, c] = triangles[t];
    surface::SurfaceHit hit =
        surface::closest_point_on_triangle(world, vertices[a], vertices[b], vertices[c]);
    hit.triangle = t;
    if (hit.distance < best.distance || (hit.distance == best.distance && t < best.triangle)) best = hit;
}

}  // namespace sidewall::levelset
