#include "levelset/extension.hpp"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>
#include <optional>

#include "levelset/block.hpp"
#include "levelset/cell_triangles.hpp"
#include "levelset/layers_below.hpp"
#include "levelset/openvdb_grid.hpp"
#include "levelset/stack.hpp"
#include "surface/leaf_table.hpp"

namespace sidewall::levelset {
namespace {

using B = Block<1>;

// Nodes this near to the front (in dx) have a sample of their own: every foot point, rounded to a node, is
// within sqrt(3)/2 of the front.
constexpr double kNearCells = 0.9;

// Unit gradient by central differences; zero where phi is flat.
Vec3 gradient_direction(const B& block, int at) {
    Vec3 g;
    for (int a = 0; a < 3; ++a) {
        const auto stride = B::kStride[a];
        g[a] = static_cast<double>(block.value[static_cast<std::size_t>(at + stride)] -
                                   block.value[static_cast<std::size_t>(at - stride)]);
    }
    const double length = g.norm();
    return length > 0.0 ? Vec3(g / length) : Vec3::Zero();
}

// The mesh that samples lie on.
class Surface {
  public:
    explicit Surface(const surface::RayScene& scene)
        : vertices(scene.vertices()), triangles(scene.triangles()), scene_(&scene) {}
    // Without a hierarchy, unless a node asks that has no triangle near.
    explicit Surface(const TriangleMesh& mesh)
        : vertices(mesh.vertices), triangles(mesh.triangles), mesh_(&mesh) {}

    surface::SurfaceHit closest(const CellTriangles& cells, const openvdb::Coord& node, const Vec3& world,
                                double dx) const {
        constexpr double kSure = 0.99, kFar = 1.99;  // dx; the margins are for rounding
        surface::SurfaceHit best;
        // All points less than a cell away lie in the cells around the node.
        best.distance = kSure * dx;
        cells.each_around(node, [&](std::uint32_t t) { keep_nearer(t, world, best); });
        if (best) return best;
        best.distance = kFar * dx;
        cells.each_in_leaves(node, 2, [&](std::uint32_t t) { keep_nearer(t, world, best); });
        if (best) return best;
        // Isolated: a thread that waits for the hierarchy's own tasks must not come back here with another
        // node.
        if (scene_ == nullptr)
            std::call_once(once_,
                           [&] { tbb::this_task_arena::isolate([&] { own_scene_.emplace(*mesh_); }); });
        return (scene_ != nullptr ? *scene_ : *own_scene_).closest_point(world, 1e30);
    }

    const std::span<const Vec3> vertices;
    const std::span<const Triangle> triangles;

  private:
    // Of equals, the lowest triangle is the nearest.
    void keep_nearer(std::uint32_t t, const Vec3& world, surface::SurfaceHit& best) const {
        const auto [a, b, c] = triangles[t];
        surface::SurfaceHit hit =
            surface::closest_point_on_triangle(world, vertices[a], vertices[b], vertices[c]);
        hit.triangle = t;
        if (hit.distance < best.distance || (hit.distance == best.distance && t < best.triangle)) best = hit;
    }

    const surface::RayScene* scene_ = nullptr;
    const TriangleMesh* mesh_ = nullptr;
    mutable std::once_flag once_;
    mutable std::optional<surface::RayScene> own_scene_;
};

// In a smooth region the foot point lies along the gradient; elsewhere, or where the mesh is farther off than
// the level set says, the nearest point is searched.
SurfaceSample find_sample(const CellTriangles& cells, const Surface& surface, const openvdb::Coord& node,
                          const Vec3& world, double phi, const Vec3& normal, double dx) {
    SurfaceSample sample{0, 0.0f, 0.0f, {node.x(), node.y(), node.z()}};
    CellTriangles::Hit near{surface::kNoTriangle, 0.0f, 0.0f};
    if (normal != Vec3::Zero()) near = cells.nearest_hit(node, normal, -phi / dx);
    if (near) {
        sample.triangle = near.triangle, sample.u = near.u, sample.v = near.v;
    } else {
        const surface::SurfaceHit hit = surface.closest(cells, node, world, dx);
        sample.triangle = hit.triangle;
        sample.u = static_cast<float>(hit.u), sample.v = static_cast<float>(hit.v);
    }
    const auto [a, b, c] = surface.triangles[sample.triangle];
    const double u = static_cast<double>(sample.u), v = static_cast<double>(sample.v);
    const Vec3 foot =
        ((1.0 - u - v) * surface.vertices[a] + u * surface.vertices[b] + v * surface.vertices[c] - world) /
        dx;
    sample.foot = foot.cast<float>();
    return sample;
}

openvdb::Coord own_node(const Domain& domain, const openvdb::Coord& c) {
    if (domain.owns(c.x(), c.y())) return c;
    return {domain.source_node(0, c.x()), domain.source_node(1, c.y()), c.z()};
}

// What is known of every node of the grid's leaves on the way to its sample; -1 off the band.
class Entries {
  public:
    Entries(const surface::LeafTable& table, std::size_t leaves)
        : table_(table), value_(std::make_unique_for_overwrite<std::int32_t[]>(leaves * Leaf::SIZE)) {}
    std::int32_t* of(std::size_t leaf) { return &value_[leaf * Leaf::SIZE]; }
    std::int32_t at(const openvdb::Coord& node) const {
        const std::int32_t leaf = table_.find(node.x() >> 3, node.y() >> 3, node.z() >> 3);
        return leaf < 0 ? -1
                        : value_[static_cast<std::size_t>(leaf) * Leaf::SIZE + Leaf::coordToOffset(node)];
    }

  private:
    const surface::LeafTable& table_;
    std::unique_ptr<std::int32_t[]> value_;
};

// At a kink the gradient does not point at the foot: go from neighbour to neighbour, always to the one
// nearest to the front, until one has a sample.
std::int32_t descend(const Grid::ConstUnsafeAccessor& phi, const Entries& entries, const Domain& domain,
                     openvdb::Coord c) {
    float distance = std::abs(phi.getValue(c));
    for (;;) {
        openvdb::Coord best = c;
        // Face neighbours before edge and corner ones: of equals the one straight ahead.
        for (int faces = 1; faces <= 3; ++faces)
            for (int n = 0; n < 27; ++n) {
                const openvdb::Coord offset(n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1);
                if (std::abs(offset.x()) + std::abs(offset.y()) + std::abs(offset.z()) != faces) continue;
                const openvdb::Coord q = own_node(domain, c + offset);
                const float d = std::abs(phi.getValue(q));
                if (d < distance) {
                    distance = d;
                    best = q;
                }
            }
        const std::int32_t found = entries.at(best);
        if (found >= 0 || best == c) return std::max(found, -1);
        c = best;
    }
}

// In leaves where nothing can move all nodes share the first sample; what entry their far nodes have
// meanwhile.
constexpr std::int32_t kStill = -1;

void share_first(const Leaf& leaf, float near, std::int32_t* entry) {
    for (auto it = leaf.cbeginValueOn(); it; ++it) entry[it.pos()] = std::abs(*it) <= near ? 0 : kStill;
}

// A far node's foot, rounded to a node, until it is looked up: the offset from the node, coded in its entry.
constexpr int kBits = 5, kMiddle = 1 << (kBits - 1);

std::int32_t encode(const openvdb::Coord& offset) {
    const openvdb::Coord o = offset.offsetBy(kMiddle);
    return -2 - (o.x() << 2 * kBits | o.y() << kBits | o.z());
}

openvdb::Coord decode(std::int32_t entry) {
    const int code = -2 - entry, mask = (1 << kBits) - 1;
    return openvdb::Coord(code >> 2 * kBits, code >> kBits & mask, code & mask).offsetBy(-kMiddle);
}

// Far nodes take the sample of the node beside their foot point.
void share_samples(const Grid& grid, const Domain& domain, const std::vector<const Leaf*>& leaves,
                   Entries& entries, IndexTree& sample_of) {
    std::vector<IndexTree::LeafNodeType*> samples;
    sample_of.getNodes(samples);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 16), [&](const auto& range) {
        const auto accessor = grid.getConstUnsafeAccessor();
        for (std::size_t n = range.begin(); n != range.end(); ++n) {
            const Leaf& leaf = *leaves[n];
            const std::int32_t* entry = entries.of(n);
            std::int32_t* out = samples[n]->buffer().data();
            // No foot lies farther than a leaf away.
            const openvdb::Coord o = leaf.origin();
            const bool inner = domain.owns(o.x() - 8, o.y() - 8) && domain.owns(o.x() + 15, o.y() + 15);
            for (auto it = leaf.cbeginValueOn(); it; ++it) {
                const std::int32_t own = entry[it.pos()];
                if (own >= 0 || own == kStill) {
                    out[it.pos()] = std::max(own, 0);
                    continue;
                }
                const openvdb::Coord c = it.getCoord();
                const openvdb::Coord foot = c + decode(own);
                const std::int32_t found = entries.at(inner ? foot : own_node(domain, foot));
                out[it.pos()] = found >= 0 ? found : descend(accessor, entries, domain, c);
            }
        }
    });
}

// \param surface  nullptr: samples carry their node and the foot along the gradient alone.
// \param under    the stack whose lower layers are looked for beside each sample; nullptr: none is.
// \param everywhere  samples that have no lower layer near look for their point on the surface, too; else the
// top layer
//                    stays where it is.
Extension build(const Grid& grid, const Domain& domain, const Surface* surface, const MaterialStack* under,
                bool everywhere = true) {
    Extension extension{{}, std::make_shared<IndexTree>(grid.tree(), -1, openvdb::TopologyCopy()), {}};
    const double dx = domain.spacing;
    const auto near = static_cast<float>(kNearCells * dx);
    std::vector<const Leaf*> leaves;
    grid.tree().getNodes(leaves);
    std::vector<std::uint32_t> first(leaves.size() + 1, 0);
    std::vector<std::uint8_t> still(leaves.size(), 0);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 16), [&](const auto& range) {
        for (std::size_t n = range.begin(); n != range.end(); ++n) {
            still[n] = under && !everywhere && LayersBelow::none_around(*under, leaves[n]->origin());
            if (still[n]) continue;
            for (auto it = leaves[n]->cbeginValueOn(); it; ++it) first[n + 1] += std::abs(*it) <= near;
        }
    });
    const auto any_still = std::find(still.begin(), still.end(), 1);
    first[0] = any_still != still.end() ? 1 : 0;
    for (std::size_t n = 0; n < leaves.size(); ++n) first[n + 1] += first[n];
    extension.samples.resize(first.back());
    extension.alone.resize(under ? first.back() : 0);
    if (first[0] == 1) {
        const openvdb::Coord c = leaves[static_cast<std::size_t>(any_still - still.begin())]->origin();
        extension.samples.front().node = {c.x(), c.y(), c.z()};
        extension.alone.front() = 1;
    }
    std::optional<CellTriangles> cells;
    if (surface) cells.emplace(leaves, domain, surface->vertices, surface->triangles);
    const surface::LeafTable table(leaves);
    const LeafData data(table, leaves);
    Entries entries(table, leaves.size());

    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 16), [&](const auto& range) {
        B block;
        for (std::size_t n = range.begin(); n != range.end(); ++n) {
            const Leaf& leaf = *leaves[n];
            std::int32_t* index = entries.of(n);
            std::fill_n(index, Leaf::SIZE, -1);
            if (still[n]) {
                share_first(leaf, near, index);
                continue;
            }
            load_block(data, domain, leaf, grid.background(), block);
            std::optional<LayersBelow> below;
            if (under && first[n] != first[n + 1]) below.emplace(*under, leaf.origin());
            std::uint32_t k = first[n];
            for (auto it = leaf.cbeginValueOn(); it; ++it) {
                const openvdb::Coord c = it.getCoord();
                const auto phi = static_cast<double>(*it);
                const Vec3 normal = gradient_direction(block, B::at(c.x() & 7, c.y() & 7, c.z() & 7));
                const Vec3 foot = -phi / dx * normal;
                if (std::abs(*it) <= near) {
                    const auto number = static_cast<std::int32_t>(k++);
                    index[it.pos()] = number;
                    SurfaceSample& sample = extension.samples[static_cast<std::size_t>(number)];
                    sample = {0, 0.0f, 0.0f, {c.x(), c.y(), c.z()}, foot.cast<float>()};
                    const bool alone = below && below->none_near(c, foot);
                    if (alone) extension.alone[static_cast<std::size_t>(number)] = 1;
                    if (surface && (everywhere || !alone)) {
                        const Vec3 world(domain.coordinate(0, c.x()), domain.coordinate(1, c.y()),
                                         domain.coordinate(2, c.z()));
                        sample = find_sample(*cells, *surface, c, world, phi, normal, dx);
                    }
                } else {
                    index[it.pos()] = encode({static_cast<int>(std::floor(foot.x() + 0.5)),
                                              static_cast<int>(std::floor(foot.y() + 0.5)),
                                              static_cast<int>(std::floor(foot.z() + 0.5))});
                }
            }
        }
    });

    share_samples(grid, domain, leaves, entries, *extension.sample_of);
    return extension;
}

}  // namespace

Extension extend(const Grid& grid, const Domain& domain, const surface::RayScene& scene) {
    const Surface surface(scene);
    return build(grid, domain, &surface, nullptr);
}

Extension extend_untraced(const MaterialStack& stack, const TriangleMesh* mesh, bool top_is_inert) {
    const MaterialStack* under = stack.layers.size() > 1 ? &stack : nullptr;
    if (mesh == nullptr) return build(stack.top(), stack.domain, nullptr, under, !top_is_inert);
    const Surface surface(*mesh);
    return build(stack.top(), stack.domain, &surface, under, !top_is_inert);
}

Extension extend_alike(const Grid& grid) {
    Extension extension{{}, std::make_shared<IndexTree>(grid.tree(), -1, 0, openvdb::TopologyCopy()), {}};
    if (const auto first = grid.cbeginValueOn()) {
        const openvdb::Coord c = first.getCoord();
        extension.samples.push_back({0, 0.0f, 0.0f, {c.x(), c.y(), c.z()}});
    }
    return extension;
}

Extension extend_without_mesh(const Grid& grid, const Domain& domain) {
    return build(grid, domain, nullptr, nullptr);
}

}  // namespace sidewall::levelset
