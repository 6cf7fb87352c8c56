#include "levelset/motion/speed_extension.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <memory>
#include <optional>

#include "levelset/block.hpp"
#include "levelset/layers/layers_below.hpp"
#include "levelset/layers/stack.hpp"
#include "levelset/motion/cell_triangles.hpp"
#include "levelset/motion/sample_index.hpp"
#include "levelset/openvdb_grid.hpp"
#include "levelset/rounding.hpp"
#include "levelset/row.hpp"
#include "surface/extraction/leaf_table.hpp"
#include "surface/parallel.hpp"

namespace sidewall::levelset {
namespace {

using Patch = Block<1>;

// Cells (dx): nodes nearer to the front have their own sample. A foot point rounded to a node is within
// sqrt(3)/2 of the front, so that this node has one.
constexpr double kNearCells = 0.9;

// A foot point midway between two nodes is rounded towards the node that it belongs to.
constexpr double kToOwn = 1.0 - 1e-4;

// The offset between two nodes, coded as a number from kFirstCode down to kLastCode.
constexpr int kBits = 5, kMiddle = 1 << (kBits - 1), kFirstCode = -2,
              kLastCode = kFirstCode - (1 << 3 * kBits);

std::int32_t encode(std::int32_t x, std::int32_t y, std::int32_t z) {
    return kFirstCode - ((x + kMiddle) << 2 * kBits | (y + kMiddle) << kBits | (z + kMiddle));
}

openvdb::Coord decode(std::int32_t code) {
    const int number = kFirstCode - code, mask = (1 << kBits) - 1;
    return openvdb::Coord(number >> 2 * kBits, number >> kBits & mask, number & mask).offsetBy(-kMiddle);
}

// For each node of a row: the unit gradient by central differences, zero where phi is flat; the vector to the
// foot point along it, in dx; and the code of that vector rounded to a node.
struct Feet {
    std::array<std::array<double, kLanes>, 3> normal, foot;
    std::array<std::int32_t, kLanes> code;

    Vec3 normal_of(std::size_t z) const { return {normal[0][z], normal[1][z], normal[2][z]}; }
    Vec3 foot_of(std::size_t z) const { return {foot[0][z], foot[1][z], foot[2][z]}; }
};

// One loop, which compilers vectorise; smaller ones they unroll into single nodes.
void find_feet(const float* v, double dx, Feet& feet) {
    for (std::size_t n = 0; n < kLanes; ++n) {
        const auto at = static_cast<std::ptrdiff_t>(n);
        const auto rise = [&](std::ptrdiff_t stride) {
            return static_cast<double>(v[at + stride] - v[at - stride]);
        };
        const double x = rise(Patch::kStride[0]), y = rise(Patch::kStride[1]), z = rise(Patch::kStride[2]);
        const double steepness = std::sqrt(x * x + (y * y + z * z)),
                     length = steepness > 0.0 ? steepness : 1.0;
        const double back = -static_cast<double>(v[at]) / dx;
        const double nx = x / length, ny = y / length, nz = z / length;
        const double fx = back * nx, fy = back * ny, fz = back * nz;
        feet.normal[0][n] = nx, feet.normal[1][n] = ny, feet.normal[2][n] = nz;
        feet.foot[0][n] = fx, feet.foot[1][n] = fy, feet.foot[2][n] = fz;
        feet.code[n] = encode(static_cast<std::int32_t>(std::floor(kToOwn * fx + 0.5)),
                              static_cast<std::int32_t>(std::floor(kToOwn * fy + 0.5)),
                              static_cast<std::int32_t>(std::floor(kToOwn * fz + 0.5)));
    }
}

// The periodic image of a node whose foot point lies between the domain's periodic sides.
openvdb::Coord image_at(const Domain& domain, openvdb::Coord node, const Vec3& foot) {
    for (int axis = 0; axis < 2; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        const int cells = domain.cells[a];
        const double at = node[axis] + foot[axis];
        if (domain.side[a] == Side::periodic) node[axis] += at < 0.0 ? cells : at > cells ? -cells : 0;
    }
    return node;
}

// The sample of a node. In a smooth region its foot point lies along the gradient; elsewhere, or where mesh
// and level set disagree, the closest point is searched.
SurfaceSample find_sample(const CellTriangles& cells, const NearestSurface& surface, const Domain& domain,
                          const openvdb::Coord& node, double phi, const Vec3& normal) {
    const double dx = domain.spacing;
    Vec3 world(domain.coordinate(0, node.x()), domain.coordinate(1, node.y()),
               domain.coordinate(2, node.z()));
    SurfaceSample sample{0, 0.0f, 0.0f, {node.x(), node.y(), node.z()}};
    CellTriangles::Hit near{surface::kNoTriangle, 0.0f, 0.0f};
    openvdb::Coord image = image_at(domain, node, -phi / dx * normal);
    if (normal != Vec3::Zero()) {
        near = cells.nearest_hit(image, normal, -phi / dx);
        if (!near)  // the foot point may lie on the side itself
            for (const openvdb::Coord& other : images_beside(domain, node))
                if (!near) near = cells.nearest_hit(image = other, normal, -phi / dx);
    }
    if (near) {
        for (int axis = 0; axis < 2; ++axis) world[axis] += dx * (image[axis] - node[axis]);
        sample.triangle = near.triangle, sample.u = near.u, sample.v = near.v;
    } else {
        const surface::SurfaceHit hit = surface.closest(cells, domain, node, world);
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

// The sample of a node next to the front; negative for others, whose entries other threads may be setting.
std::int32_t own_sample(const std::int32_t* entries, openvdb::Index node) {
    if (entries == nullptr) return -1;
    return std::atomic_ref(const_cast<std::int32_t&>(entries[node])).load(std::memory_order_relaxed);
}

std::int32_t own_sample(const SampleIndex& index, const openvdb::Coord& node) {
    return own_sample(index.find(node), Leaf::coordToOffset(node));
}

// Offsets to a node's neighbours: face neighbours before edge and corner ones, opposite ones in a row, so
// that a mirrored wafer gives a mirrored result.
const auto kNeighbours = [] {
    std::vector<openvdb::Coord> offsets;
    for (int n = 0; n < 27; ++n)
        if (n != 13) offsets.emplace_back(n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1);
    std::stable_sort(offsets.begin(), offsets.end(), [](const openvdb::Coord& a, const openvdb::Coord& b) {
        const auto order = [](const openvdb::Coord& c) {
            const int x = std::abs(c.x()), y = std::abs(c.y()), z = std::abs(c.z());
            return std::array{x + y + z, x, y};
        };
        return order(a) < order(b);
    });
    return offsets;
}();

// The sample of a node at a kink, where the gradient misses the foot point: steps from neighbour to
// neighbour, to the nearest to the front (ties: the first in kNeighbours), until one has a sample.
std::int32_t descend(const LeafData& phi, float background, const SampleIndex& index, const Domain& domain,
                     openvdb::Coord c) {
    const auto distance_of = [&](const openvdb::Coord& node) {
        const float* leaf = phi.find(node.x() >> 3, node.y() >> 3, node.z() >> 3);
        return leaf ? std::abs(leaf[Leaf::coordToOffset(node)]) : background;
    };
    const float tie = kTie * static_cast<float>(domain.spacing);
    float distance = distance_of(c);
    for (;;) {
        openvdb::Coord best = c;
        for (const openvdb::Coord& offset : kNeighbours) {
            const openvdb::Coord q = own_node(domain, c + offset);
            const float d = distance_of(q);
            if (d < distance - tie) {
                distance = d;
                best = q;
            }
        }
        const std::int32_t found = own_sample(index, best);
        if (found >= 0 || best == c) return std::max(found, -1);
        c = best;
    }
}

// Lets all nodes of a leaf in which nothing can move share the first sample.
void share_first(const Leaf& leaf, float near, std::int32_t* entry) {
    for (auto it = leaf.cbeginValueOn(); it; ++it)
        entry[it.pos()] = std::abs(*it) <= near ? 0 : SampleIndex::kShared;
}

// Marks the nodes of a row off the band, and codes the foot points of the others until samples are found.
void set_codes(const Feet& feet, const LaneMask& active, std::int32_t* entry) {
    for (std::size_t z = 0; z < kLanes; ++z)
        entry[z] = (feet.code[z] & active[z]) | (SampleIndex::kNone & ~active[z]);
}

// The entries of a leaf and of those around it. Foot points are at most a leaf away.
class EntriesAround {
  public:
    EntriesAround(const SampleIndex& index, const openvdb::Coord& origin) {
        const openvdb::Coord at(origin.x() >> 3, origin.y() >> 3, origin.z() >> 3);
        for (int n = 0; n < 27; ++n)
            leaf_[static_cast<std::size_t>(n)] =
                index.find(at.x() + n / 9 - 1, at.y() + n / 3 % 3 - 1, at.z() + n % 3 - 1);
    }
    // \param c  a node, relative to the leaf's origin.
    std::int32_t own_sample_at(const openvdb::Coord& c) const {
        const auto leaf =
            static_cast<std::size_t>(((c.x() >> 3) + 1) * 9 + ((c.y() >> 3) + 1) * 3 + (c.z() >> 3) + 1);
        return own_sample(leaf_[leaf], Leaf::coordToOffset(c));
    }

  private:
    std::array<const std::int32_t*, 27> leaf_;
};

// Gives far nodes the sample of the node nearest to their foot point.
void share_samples(const LeafData& phi, float background, const Domain& domain,
                   const std::vector<const Leaf*>& leaves, SampleIndex& index) {
    surface::parallel_each(leaves.size(), 4, [&](std::size_t n) {
        const Leaf& leaf = *leaves[n];
        std::int32_t* entry = index.of(n);
        const openvdb::Coord o = leaf.origin();
        const bool inner = domain.owns(o.x() - 8, o.y() - 8) && domain.owns(o.x() + 15, o.y() + 15);
        const EntriesAround around(index, o);
        for (auto it = leaf.cbeginValueOn(); it; ++it) {
            const std::int32_t own = entry[it.pos()];
            if (own > kFirstCode || own <= kLastCode) continue;
            const openvdb::Coord local = Leaf::offsetToLocalCoord(it.pos()) + decode(own);
            const openvdb::Coord foot = o + local;
            std::int32_t found = inner || domain.owns(foot.x(), foot.y())
                                     ? around.own_sample_at(local)
                                     : own_sample(index, own_node(domain, foot));
            if (found < 0) found = descend(phi, background, index, domain, it.getCoord());
            std::atomic_ref(entry[it.pos()])
                .store(found >= 0 ? found | SampleIndex::kShared : SampleIndex::kNone,
                       std::memory_order_relaxed);
        }
    });
}

// The number of a leaf's nodes near the front; nodes off the band hold the background and are far.
std::uint32_t count_near(const Leaf& leaf, float near) {
    const float* v = leaf.buffer().data();
    std::int32_t count = 0;
    for (openvdb::Index k = 0; k < Leaf::SIZE; ++k) count += std::abs(v[k]) <= near;
    return static_cast<std::uint32_t>(count);
}

// Sets the first sample, which stands for all nodes of leaves that do not move.
void set_still_sample(const openvdb::Coord& origin, Extension& extension) {
    extension.samples.front() = {0, 0.0f, 0.0f, {origin.x(), origin.y(), origin.z()}};
    extension.alone.front() = 1;
}

// \param surface  nullptr: samples hold only their node and the foot point along the gradient.
// \param under    the stack whose lower layers are searched beside each sample; nullptr: none are.
// \param left_out  see extend.
// \param everywhere  false: the top layer does not move, and samples with no other near get no triangle.
Extension build(const Grid& grid, const Domain& domain, const NearestSurface* surface,
                const MaterialStack* under, const LevelColumns* left_out, bool everywhere = true) {
    Extension extension;
    const double dx = domain.spacing;
    const auto near = static_cast<float>(kNearCells * dx);
    std::vector<const Leaf*> leaves;
    grid.tree().getNodes(leaves);
    std::vector<std::uint32_t> first(leaves.size() + 1, 0);
    std::vector<std::uint8_t> still(leaves.size(), 0);
    const auto is_left_out = [&](const Leaf& leaf) {
        return left_out && left_out->of_coarser_node(leaf.origin().x(), leaf.origin().y());
    };
    surface::parallel_each(leaves.size(), 4, [&](std::size_t n) {
        if (is_left_out(*leaves[n])) return;
        still[n] = under && !everywhere && LayersBelow::none_around(*under, leaves[n]->origin());
        if (!still[n]) first[n + 1] = count_near(*leaves[n], near);
    });
    const auto any_still = std::find(still.begin(), still.end(), 1);
    first[0] = any_still != still.end() ? 1 : 0;
    for (std::size_t n = 0; n < leaves.size(); ++n) first[n + 1] += first[n];
    extension.samples.resize(first.back());
    extension.alone.resize(under ? first.back() : 0);
    if (first[0] == 1)
        set_still_sample(leaves[static_cast<std::size_t>(any_still - still.begin())]->origin(), extension);
    std::optional<CellTriangles> cells;
    if (surface) cells.emplace(leaves, domain, surface->vertices, surface->triangles);
    const auto index = std::make_shared<SampleIndex>(leaves);
    const LeafData data(index->table(), leaves);

    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 4), [&](const auto& range) {
        Patch block;
        Feet feet;
        for (std::size_t n = range.begin(); n != range.end(); ++n) {
            const Leaf& leaf = *leaves[n];
            std::int32_t* entry = index->of(n);
            std::fill_n(entry, Leaf::SIZE, SampleIndex::kNone);
            if (is_left_out(leaf)) continue;
            if (still[n]) {
                share_first(leaf, near, entry);
                continue;
            }
            load_axes(data, domain, leaf, grid.background(), block);
            std::optional<LayersBelow> below;
            if (under && first[n] != first[n + 1]) below.emplace(*under, leaf.origin());
            std::uint32_t k = first[n];
            const auto add_sample = [&](openvdb::Index node, std::size_t z) {
                entry[node] = static_cast<std::int32_t>(k);
                const openvdb::Coord c = leaf.offsetToGlobalCoord(node);
                const Vec3 foot = feet.foot_of(z);
                SurfaceSample& sample = extension.samples[k];
                sample = {0, 0.0f, 0.0f, {c.x(), c.y(), c.z()}, foot.cast<float>()};
                const bool alone = below && below->none_near(c, foot);
                if (alone) extension.alone[k] = 1;
                if (surface && (everywhere || !alone))
                    sample = find_sample(*cells, *surface, domain, c,
                                         static_cast<double>(leaf.getValue(node)), feet.normal_of(z));
                ++k;
            };
            for (openvdb::Index row = 0; row < 64; ++row) {
                const auto active = leaf.getValueMask().getWord<openvdb::Byte>(row);
                if (active == 0) continue;
                const float* v = &block.value[static_cast<std::size_t>(
                    Patch::at(static_cast<int>(row >> 3), static_cast<int>(row & 7), 0))];
                find_feet(v, dx, feet);
                set_codes(feet, kLaneMasks[active], entry + 8 * row);
                for (std::size_t z = 0; z < kLanes; ++z)
                    if (std::abs(v[z]) <= near) add_sample(8 * row + static_cast<openvdb::Index>(z), z);
            }
        }
    });

    share_samples(data, grid.background(), domain, leaves, *index);
    extension.sample_of = index;
    return extension;
}

}  // namespace

Extension extend(const Grid& grid, const Domain& domain, const surface::RayScene& scene,
                 const LevelColumns* left_out) {
    const NearestSurface surface(scene);
    return build(grid, domain, &surface, nullptr, left_out);
}

Extension extend_untraced(const MaterialStack& stack, const TriangleMesh* mesh, bool top_is_inert,
                          const LevelColumns* left_out) {
    const MaterialStack* under = stack.layers.size() > 1 ? &stack : nullptr;
    if (mesh == nullptr) return build(stack.top(), stack.domain, nullptr, under, left_out, !top_is_inert);
    const NearestSurface surface(*mesh);
    return build(stack.top(), stack.domain, &surface, under, left_out, !top_is_inert);
}

Extension extend_uniform(const Grid& grid) {
    std::vector<const Leaf*> leaves;
    grid.tree().getNodes(leaves);
    Extension extension{{}, std::make_shared<SampleIndex>(leaves, SampleIndex::Uniform{}), {}};
    if (const auto first = grid.cbeginValueOn()) {
        const openvdb::Coord c = first.getCoord();
        extension.samples.push_back({0, 0.0f, 0.0f, {c.x(), c.y(), c.z()}});
    }
    return extension;
}

}  // namespace sidewall::levelset
