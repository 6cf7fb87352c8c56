#include "levelset/motion/cell_triangles.hpp"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>

#include "levelset/rounding.hpp"
#include "surface/parallel.hpp"

namespace sidewall::levelset {
namespace {

Eigen::Array4i floor(const IndexPoint& p) {
    return p.array().floor().cast<int>();
}

// Margin for rounding at cell faces, in dx: marching cubes' vertices lie on faces and must not count for the
// cells beyond.
constexpr float kFace = 1e-4f;

// The cells that a triangle passes through.
struct Cells {
    openvdb::Coord low, high;  // of its bounding box
    IndexPoint a, b, c;        // relative to the node at base
    openvdb::Coord base;

    Cells(std::span<const IndexPoint> vertices, const Triangle& t) {
        const IndexPoint &va = vertices[t[0]], &vb = vertices[t[1]], &vc = vertices[t[2]];
        const Eigen::Array4i node = floor(va);
        const IndexPoint shift = node.cast<float>().matrix();
        base = {node[0], node[1], node[2]};
        a = va - shift, b = vb - shift, c = vc - shift;
        const IndexPoint lowest = a.cwiseMin(b).cwiseMin(c).array() + kFace,
                         highest = a.cwiseMax(b).cwiseMax(c).array() - kFace;
        const Eigen::Array4i p = floor(lowest.cwiseMin(highest)), q = floor(highest.cwiseMax(lowest));
        low = base.offsetBy(p[0], p[1], p[2]);
        high = base.offsetBy(q[0], q[1], q[2]);
    }
    bool single() const { return low == high; }

    // Calls use(leaf, cell) for its cells in the leaves of a table; cells are numbered within a leaf.
    template <class Use>
    void each(const surface::LeafTable& table, Use&& use) const {
        // Long triangles pass few of their box's cells: those whose centre is near enough to their plane.
        const IndexPoint normal = (b - a).cross3(c - a);
        const float reach = 0.501f * normal.cwiseAbs().sum();
        const float offset = normal.dot(a) - 0.5f * normal.sum();
        const auto beside = [&](int x, int y, int z) {
            return std::abs(normal[0] * static_cast<float>(x - base.x()) +
                            normal[1] * static_cast<float>(y - base.y()) +
                            normal[2] * static_cast<float>(z - base.z()) - offset) <= reach;
        };
        const auto cells_in = [&](const openvdb::Coord& origin, std::size_t leaf) {
            const openvdb::Coord from = openvdb::Coord::maxComponent(low, origin),
                                 to = openvdb::Coord::minComponent(high, origin.offsetBy(7));
            for (int x = from.x(); x <= to.x(); ++x)
                for (int y = from.y(); y <= to.y(); ++y)
                    for (int z = from.z(); z <= to.z(); ++z)
                        if (beside(x, y, z)) use(leaf, Leaf::coordToOffset({x, y, z}));
        };
        const auto along = [&](int axis) {
            const auto n = static_cast<std::size_t>(axis);
            return std::pair(std::max(low[axis] >> 3, table.low(n)),
                             std::min(high[axis] >> 3, table.low(n) + table.size(n) - 1));
        };
        const auto xs = along(0), ys = along(1), zs = along(2);
        for (int x = xs.first; x <= xs.second; ++x)
            for (int y = ys.first; y <= ys.second; ++y)
                for (int z = zs.first; z <= zs.second; ++z) {
                    const std::int32_t leaf = table.find(x, y, z);
                    if (leaf >= 0) cells_in({8 * x, 8 * y, 8 * z}, static_cast<std::size_t>(leaf));
                }
    }
};

// Breaks the tie of two triangles that are equally near: the one that faces upwards more goes first (the
// floor beside a wall), then the one with the lower number.
template <class Vertices>
bool goes_first(const Vertices& vertices, std::span<const Triangle> triangles, std::uint32_t one,
                std::uint32_t other) {
    const auto up = [&](std::uint32_t t) {
        const auto [a, b, c] = triangles[t];
        const Vec3 from = vertices[a].template head<3>().template cast<double>(),
                   n = (vertices[b].template head<3>().template cast<double>() - from)
                           .cross(vertices[c].template head<3>().template cast<double>() - from);
        return n.z() / n.norm();
    };
    const double more = up(one) - up(other);
    return std::abs(more) > static_cast<double>(kTie) ? more > 0.0 : one <= other;
}

}  // namespace

std::vector<openvdb::Coord> images_beside(const Domain& domain, const openvdb::Coord& node) {
    std::vector<openvdb::Coord> images;
    std::array<int, 2> away{};
    for (std::size_t a = 0; a < 2; ++a) {
        const int cells = domain.cells[a], at = node[static_cast<int>(a)];
        if (domain.side[a] == Side::periodic && cells > 2)
            away[a] = at <= 1 ? cells : at >= cells - 1 ? -cells : 0;
    }
    if (away[0] != 0) images.push_back(node.offsetBy(away[0], 0, 0));
    if (away[1] != 0) images.push_back(node.offsetBy(0, away[1], 0));
    if (images.size() == 2) images.push_back(node.offsetBy(away[0], away[1], 0));
    return images;
}

CellTriangles::CellTriangles(const std::vector<const Leaf*>& leaves, const Domain& domain,
                             std::span<const Vec3> vertices, std::span<const Triangle> triangles)
    : vertices_(vertices.size()), triangles_(triangles), table_(leaves) {
    surface::parallel_each(vertices.size(), 1024, [&](std::size_t v) {
        vertices_[v] << domain.to_index(vertices[v]).cast<float>(), 0.0f;
    });
    // Nearly all triangles of an extracted surface lie in one cell, which is found once. Long runs lie in one
    // leaf.
    constexpr std::uint32_t kNowhere = 0xffffffffu, kSeveral = kNowhere - 1;
    LargeVector<std::uint32_t> leaf_of(triangles.size());
    LargeVector<std::uint16_t> cell_of(triangles.size());
    std::vector<std::atomic<std::uint32_t>> next(leaves.size());
    const auto take = [&](std::size_t leaf, std::uint32_t count) {
        return next[leaf].fetch_add(count, std::memory_order_relaxed);
    };
    // Calls use(t, count) for runs of triangles in one leaf, and for each single one in several cells.
    const auto each_row = [&](const auto& range, auto&& use) {
        for (std::size_t t = range.begin(), end = t; t != range.end(); t = end) {
            for (++end; end != range.end() && leaf_of[t] != kSeveral && leaf_of[end] == leaf_of[t];) ++end;
            if (leaf_of[t] != kNowhere) use(t, static_cast<std::uint32_t>(end - t));
        }
    };
    const tbb::blocked_range<std::size_t> all(0, triangles.size(), 1024);
    tbb::parallel_for(all, [&](const auto& range) {
        for (std::size_t t = range.begin(); t != range.end(); ++t) {
            const Cells cells(vertices_, triangles[t]);
            const std::int32_t leaf = table_.find(cells.low.x() >> 3, cells.low.y() >> 3, cells.low.z() >> 3);
            leaf_of[t] = !cells.single() ? kSeveral : leaf < 0 ? kNowhere : static_cast<std::uint32_t>(leaf);
            cell_of[t] = static_cast<std::uint16_t>(Leaf::coordToOffset(cells.low));
        }
        each_row(range, [&](std::size_t t, std::uint32_t count) {
            if (leaf_of[t] != kSeveral)
                take(leaf_of[t], count);
            else
                Cells(vertices_, triangles[t]).each(table_, [&](std::size_t leaf, std::uint32_t) {
                    take(leaf, 1);
                });
        });
    });
    first_.assign(leaves.size() + 1, 0);
    for (std::size_t n = 0; n < leaves.size(); ++n) {
        first_[n + 1] = first_[n] + next[n].load(std::memory_order_relaxed);
        next[n].store(first_[n], std::memory_order_relaxed);
    }
    LargeVector<Place> places(first_.back());
    tbb::parallel_for(all, [&](const auto& range) {
        each_row(range, [&](std::size_t t, std::uint32_t count) {
            if (leaf_of[t] != kSeveral) {
                std::uint32_t at = take(leaf_of[t], count);
                for (std::size_t k = t; k < t + count; ++k)
                    places[at++] = {cell_of[k], static_cast<std::uint32_t>(k)};
                return;
            }
            Cells(vertices_, triangles[t]).each(table_, [&](std::size_t leaf, std::uint32_t cell) {
                places[take(leaf, 1)] = {cell, static_cast<std::uint32_t>(t)};
            });
        });
    });
    occupied_.resize(leaves.size());
    start_.resize(first_.back() + leaves.size());
    entry_.resize(first_.back());
    surface::parallel_each(leaves.size(), 64, [&](std::size_t n) {
        sort(n, std::span<const Place>(places).subspan(first_[n], first_[n + 1] - first_[n]));
    });
}

void CellTriangles::sort(std::size_t leaf, std::span<const Place> places) {
    if (places.empty()) return;
    Occupied& in = occupied_[leaf];
    std::array<std::uint32_t, Leaf::SIZE> next;  // by cell: number of entries, then the next free one
    for (const Place& place : places) {
        std::uint64_t& word = in.cell[place.cell >> 6];
        const std::uint64_t bit = std::uint64_t{1} << (place.cell & 63);
        next[place.cell] = (word & bit) != 0 ? next[place.cell] + 1 : 1;
        word |= bit;
    }
    std::uint32_t* start = &start_[first_[leaf] + leaf];
    std::uint32_t end = first_[leaf];
    std::uint16_t rank = 0;
    for (std::size_t x = 0; x < 8; ++x) {
        in.before[x] = rank;
        for (std::uint64_t bits = in.cell[x]; bits != 0; bits &= bits - 1, ++rank) {
            std::uint32_t& here = next[x << 6 | static_cast<std::size_t>(std::countr_zero(bits))];
            start[rank] = end;
            end += std::exchange(here, end);
        }
    }
    start[rank] = end;
    for (const Place& place : places) entry_[next[place.cell]++] = place.triangle;
    // Tasks ran in any order, which must not decide between equally near triangles.
    for (std::uint16_t n = 0; n < rank; ++n)
        std::sort(&entry_[start[n]], &entry_[start[n]] + (start[n + 1] - start[n]));
}

void CellTriangles::search(const openvdb::Coord& cell, const IndexPoint& shift, const IndexPoint& foot,
                           const IndexPoint& direction, float& nearest, Hit& best) const {
    // Ray-triangle test by Möller and Trumbore, J. Graphics Tools 2 (1997) 21, from the foot point in both
    // directions. A small tolerance closes the gaps between triangles at their shared edges.
    constexpr float kEdge = 1e-5f;
    for (const std::uint32_t triangle : in_cell(cell)) {
        const auto [ia, ib, ic] = triangles_[triangle];
        const IndexPoint corner = vertices_[ia] - shift, edge1 = (vertices_[ib] - shift) - corner,
                         edge2 = (vertices_[ic] - shift) - corner;
        const IndexPoint p = direction.cross3(edge2);
        const float inverse = 1.0f / edge1.dot(p);
        const IndexPoint s = foot - corner, q = s.cross3(edge1);
        const float u = s.dot(p) * inverse, v = direction.dot(q) * inverse;
        const float away = std::abs(edge2.dot(q) * inverse);
        // No branches, as none could be predicted. A line in the triangle's plane fails by infinity or NaN.
        const bool inside = (u >= -kEdge) & (u <= 1.0f + kEdge) & (v >= -kEdge) & (u + v <= 1.0f + kEdge);
        if (!(inside & (away <= nearest + kTie))) continue;
        if (best && away >= nearest - kTie && !goes_first(vertices_, triangles_, triangle, best.triangle))
            continue;
        nearest = away;
        const float within = std::clamp(u, 0.0f, 1.0f);
        best = {triangle, within, std::clamp(v, 0.0f, 1.0f - within)};
    }
}

CellTriangles::Hit CellTriangles::nearest_hit(const openvdb::Coord& node, const Vec3& direction,
                                              double distance) const {
    Hit best{surface::kNoTriangle, 0.0f, 0.0f};
    const auto point = [](const Vec3& p) {
        return IndexPoint(static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z()),
                          0.0f);
    };
    // Relative to the leaf's origin, so that coordinates keep their digits.
    const openvdb::Coord origin = node & ~7;
    const IndexPoint shift(static_cast<float>(origin.x()), static_cast<float>(origin.y()),
                           static_cast<float>(origin.z()), 0.0f);
    const IndexPoint foot = point(Vec3(node.x() & 7, node.y() & 7, node.z() & 7) + distance * direction),
                     ray = point(direction);
    const Eigen::Array4i home = floor(foot);
    constexpr float kMost = 16.0f;
    if (!(foot.cwiseAbs().maxCoeff() <= kMost)) return best;
    float nearest = kSlack;
    search(origin.offsetBy(home[0], home[1], home[2]), shift, foot, ray, nearest, best);
    if (best) return best;
    // The mesh crosses the line before or beyond the foot's cell, or on its face.
    const IndexPoint reach = kSlack * ray.cwiseAbs() + IndexPoint::Constant(2.0f * kFace);
    const Eigen::Array4i low = floor(foot - reach), high = floor(foot + reach);
    for (int x = low[0]; x <= high[0]; ++x)
        for (int y = low[1]; y <= high[1]; ++y)
            for (int z = low[2]; z <= high[2]; ++z)
                if (x != home[0] || y != home[1] || z != home[2])
                    search(origin.offsetBy(x, y, z), shift, foot, ray, nearest, best);
    return best;
}

surface::SurfaceHit NearestSurface::closest(const CellTriangles& cells, const Domain& domain,
                                            const openvdb::Coord& node, Vec3& world) const {
    surface::SurfaceHit best = near(cells, node, world, domain.spacing);
    const Vec3 own = world;
    for (const openvdb::Coord& image : images_beside(domain, node)) {
        Vec3 from = own;
        for (int axis = 0; axis < 2; ++axis) from[axis] += domain.spacing * (image[axis] - node[axis]);
        const surface::SurfaceHit hit = near(cells, image, from, domain.spacing);
        if (hit && (!best || is_nearer(hit, best, domain.spacing))) best = hit, world = from;
    }
    if (best) return best;
    // Isolated: a thread that waits for the hierarchy's tasks must not enter here with another node.
    if (scene_ == nullptr)
        std::call_once(once_, [&] { tbb::this_task_arena::isolate([&] { own_scene_.emplace(*mesh_); }); });
    return (scene_ != nullptr ? *scene_ : *own_scene_).closest_point(world, 1e30);
}

// The nearest point by the triangles in cells; none if the surface is two cells away or more.
surface::SurfaceHit NearestSurface::near(const CellTriangles& cells, const openvdb::Coord& node,
                                         const Vec3& world, double dx) const {
    constexpr double kSure = 0.99, kFar = 1.99;  // dx; the margins are for rounding
    surface::SurfaceHit best;
    // All points less than a cell away lie in the cells around the node.
    best.distance = kSure * dx;
    const auto keep_nearer = [&](std::uint32_t t) {
        const auto [a, b, c] = triangles[t];
        surface::SurfaceHit hit =
            surface::closest_point_on_triangle(world, vertices[a], vertices[b], vertices[c]);
        hit.triangle = t;
        if (best ? is_nearer(hit, best, dx) : hit.distance < best.distance) best = hit;
    };
    cells.each_around(node, keep_nearer);
    if (best) return best;
    best.distance = kFar * dx;
    cells.each_in_leaves(node, 2, keep_nearer);
    return best;
}

bool NearestSurface::is_nearer(const surface::SurfaceHit& hit, const surface::SurfaceHit& best,
                               double dx) const {
    const double less = best.distance - hit.distance;
    return std::abs(less) > static_cast<double>(kTie) * dx
               ? less > 0.0
               : goes_first(vertices, triangles, hit.triangle, best.triangle);
}

}  // namespace sidewall::levelset
