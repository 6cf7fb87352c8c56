#include "levelset/motion/nearest_surface.hpp"

#include <tbb/task_arena.h>

#include <array>

#include "levelset/openvdb_grid.hpp"

namespace sidewall::levelset {
namespace {

// Periods along an axis to the image of a node from which the surface beyond the side is seen; 0 if the node
// is not next to a periodic side. Along an axis of a cell or two the surface is everywhere the same.
int periods_beyond(const Domain& domain, std::size_t axis, int node) {
    const int cells = domain.cells[axis];
    if (domain.side[axis] != Side::periodic || cells <= 2) return 0;
    return node <= 1 ? 1 : node >= cells - 1 ? -1 : 0;
}

}  // namespace

surface::SurfaceHit NearestSurface::closest(const CellTriangles& cells, const Domain& domain,
                                            const openvdb::Coord& node, Vec3& world) const {
    surface::SurfaceHit best = near(cells, node, world, domain.spacing);
    const Vec3 own = world;
    const std::array periods{periods_beyond(domain, 0, node.x()), periods_beyond(domain, 1, node.y())};
    for (const auto [x, y] : {std::array{periods[0], 0}, {0, periods[1]}, periods}) {
        if (x == 0 && y == 0) continue;
        const Vec3 from =
            own + Vec3(x * (domain.max[0] - domain.min[0]), y * (domain.max[1] - domain.min[1]), 0.0);
        const surface::SurfaceHit hit =
            near(cells, node.offsetBy(x * domain.cells[0], y * domain.cells[1], 0), from, domain.spacing);
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
