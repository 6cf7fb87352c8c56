#include "levelset/leaf_triangles.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "surface/leaf_table.hpp"

namespace sidewall::levelset {
namespace {

Eigen::Array4i floor(const IndexPoint& p) {
    return p.array().floor().cast<int>();
}

// Runs op(leaf index) for every leaf whose nodes, grown by `reach`, meet the triangle's bounding box.
template <class Op>
void for_each_leaf(const surface::LeafTable& table, const IndexPoint& a, const IndexPoint& b,
                   const IndexPoint& c, float reach, Op&& op) {
    // Nodes of leaf L are 8 L .. 8 L + 7.
    const IndexPoint low = (a.cwiseMin(b).cwiseMin(c).array() - reach - 7.0f) * 0.125f;
    const IndexPoint high = (a.cwiseMax(b).cwiseMax(c).array() + reach) * 0.125f;
    const Eigen::Array4i below = floor(-low), last = floor(high);
    int from[3], to[3];
    for (int k = 0; k < 3; ++k) {
        const auto n = static_cast<std::size_t>(k);
        from[k] = std::max(-below[k], table.low(n));
        to[k] = std::min(last[k], table.low(n) + table.size(n) - 1);
    }
    for (int x = from[0]; x <= to[0]; ++x)
        for (int y = from[1]; y <= to[1]; ++y)
            for (int z = from[2]; z <= to[2]; ++z) {
                const std::int32_t leaf = table.find(x, y, z);
                if (leaf >= 0) op(static_cast<std::size_t>(leaf));
            }
}

// Cell faces, with a margin (dx) for rounding.
constexpr float kFace = 1e-4f;

}  // namespace

IndexMesh to_index_space(const Domain& domain, std::span<const Vec3> vertices,
                         std::span<const Triangle> triangles) {
    IndexMesh mesh{std::vector<IndexPoint>(vertices.size()), triangles};
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, vertices.size(), 4096), [&](const auto& range) {
        for (std::size_t v = range.begin(); v != range.end(); ++v)
            mesh.vertices[v] << domain.to_index(vertices[v]).cast<float>(), 0.0f;
    });
    return mesh;
}

LeafTriangles bin_by_leaf(const std::vector<const Leaf*>& leaves, const IndexMesh& mesh, float reach) {
    const surface::LeafTable table(leaves);
    std::vector<std::atomic<std::uint32_t>> count(leaves.size());
    const auto each = [&](auto&& op) {
        tbb::parallel_for(
            tbb::blocked_range<std::size_t>(0, mesh.triangles.size(), 4096), [&](const auto& range) {
                for (std::size_t t = range.begin(); t != range.end(); ++t) {
                    const auto [a, b, c] = mesh.triangles[t];
                    for_each_leaf(table, mesh.vertices[a], mesh.vertices[b], mesh.vertices[c], reach,
                                  [&](std::size_t leaf) { op(leaf, static_cast<std::uint32_t>(t)); });
                }
            });
    };
    each([&](std::size_t leaf, std::uint32_t) { count[leaf].fetch_add(1, std::memory_order_relaxed); });
    LeafTriangles lists;
    lists.first.assign(leaves.size() + 1, 0);
    for (std::size_t n = 0; n < leaves.size(); ++n) {
        lists.first[n + 1] = lists.first[n] + count[n].load(std::memory_order_relaxed);
        count[n].store(lists.first[n], std::memory_order_relaxed);
    }
    lists.triangle.resize(lists.first.back());
    each([&](std::size_t leaf, std::uint32_t t) {
        lists.triangle[count[leaf].fetch_add(1, std::memory_order_relaxed)] = t;
    });
    return lists;
}

void LeafCells::fill(const openvdb::Coord& origin, const IndexMesh& mesh,
                     std::span<const std::uint32_t> candidates) {
    head_.fill(-1);
    locals_.clear();
    entries_.clear();
    const IndexPoint shift(static_cast<float>(origin.x()), static_cast<float>(origin.y()),
                           static_cast<float>(origin.z()), 0.0f);
    for (const std::uint32_t t : candidates) {
        const auto [ia, ib, ic] = mesh.triangles[t];
        const IndexPoint a = mesh.vertices[ia] - shift, b = mesh.vertices[ib] - shift,
                         c = mesh.vertices[ic] - shift;
        // Marching cubes' vertices lie on cell faces, which must not count for the cells beyond.
        const IndexPoint low = a.cwiseMin(b).cwiseMin(c).array() + kFace,
                         high = a.cwiseMax(b).cwiseMax(c).array() - kFace;
        const Eigen::Array4i p = floor(low.cwiseMin(high)), q = floor(high.cwiseMax(low));
        const int from[3] = {std::max(p[0], -kMargin), std::max(p[1], -kMargin), std::max(p[2], -kMargin)};
        constexpr int kLast = kSide - kMargin - 1;
        const int to[3] = {std::min(q[0], kLast), std::min(q[1], kLast), std::min(q[2], kLast)};
        if (to[0] < from[0] || to[1] < from[1] || to[2] < from[2]) continue;
        const auto local = static_cast<std::int32_t>(locals_.size());
        locals_.push_back({a, b - a, c - a, t});
        const auto insert = [&](int x, int y, int z) {
            std::int32_t& head = head_[cell(x, y, z)];
            entries_.push_back({head, local});
            head = static_cast<std::int32_t>(entries_.size() - 1);
        };
        if (from[0] == to[0] && from[1] == to[1] && from[2] == to[2]) {
            insert(from[0], from[1], from[2]);
            continue;
        }
        // Long triangles pass few of their box's cells: those whose centre is near enough to their plane.
        const IndexPoint normal = (b - a).cross3(c - a);
        const float reach = 0.501f * normal.cwiseAbs().sum();
        const float offset = normal.dot(a) - 0.5f * normal.sum();
        for (int x = from[0]; x <= to[0]; ++x)
            for (int y = from[1]; y <= to[1]; ++y) {
                const float part =
                    normal[0] * static_cast<float>(x) + normal[1] * static_cast<float>(y) - offset;
                for (int z = from[2]; z <= to[2]; ++z)
                    if (std::abs(part + normal[2] * static_cast<float>(z)) <= reach) insert(x, y, z);
            }
    }
}

void LeafCells::search(std::size_t cell, const IndexPoint& foot, const IndexPoint& direction, float& nearest,
                       Hit& best) const {
    // Möller and Trumbore, J. Graphics Tools 2 (1997) 21, from the foot point both ways. Edges are shared, so
    // a little tolerance closes the gaps between neighbours.
    constexpr float kEdge = 1e-5f;
    for (std::int32_t e = head_[cell]; e >= 0; e = entries_[static_cast<std::size_t>(e)].next) {
        const LocalTriangle& t =
            locals_[static_cast<std::size_t>(entries_[static_cast<std::size_t>(e)].local)];
        const IndexPoint p = direction.cross3(t.edge2);
        const float determinant = t.edge1.dot(p);
        if (determinant == 0.0f) continue;
        const float inverse = 1.0f / determinant;
        const IndexPoint s = foot - t.corner;
        const float u = s.dot(p) * inverse;
        if (!(u >= -kEdge && u <= 1.0f + kEdge)) continue;
        const IndexPoint q = s.cross3(t.edge1);
        const float v = direction.dot(q) * inverse;
        if (!(v >= -kEdge && u + v <= 1.0f + kEdge)) continue;
        const float away = std::abs(t.edge2.dot(q) * inverse);
        if (away > nearest || (away == nearest && t.triangle > best.triangle)) continue;
        nearest = away;
        const float within = std::clamp(u, 0.0f, 1.0f);
        best = {t.triangle, within, std::clamp(v, 0.0f, 1.0f - within)};
    }
}

LeafCells::Hit LeafCells::nearest_hit(const Vec3& node, const Vec3& direction, double distance) const {
    Hit best{surface::kNoTriangle, 0.0f, 0.0f};
    const auto point = [](const Vec3& p) {
        return IndexPoint(static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z()),
                          0.0f);
    };
    const IndexPoint foot = point(node + distance * direction), ray = point(direction);
    const Eigen::Array4i home = floor(foot);
    constexpr int kLast = kSide - kMargin - 1;
    for (int k = 0; k < 3; ++k)
        if (home[k] < -kMargin || home[k] > kLast) return best;
    float nearest = kSlack;
    search(cell(home[0], home[1], home[2]), foot, ray, nearest, best);
    if (best) return best;
    // The mesh crosses the line before or beyond the foot's cell, or on its face.
    const IndexPoint reach = kSlack * ray.cwiseAbs() + IndexPoint::Constant(2.0f * kFace);
    const Eigen::Array4i low = floor(foot - reach), high = floor(foot + reach);
    for (int x = std::max(low[0], -kMargin); x <= std::min(high[0], kLast); ++x)
        for (int y = std::max(low[1], -kMargin); y <= std::min(high[1], kLast); ++y)
            for (int z = std::max(low[2], -kMargin); z <= std::min(high[2], kLast); ++z)
                if (x != home[0] || y != home[1] || z != home[2])
                    search(cell(x, y, z), foot, ray, nearest, best);
    return best;
}

}  // namespace sidewall::levelset
