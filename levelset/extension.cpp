#include "levelset/extension.hpp"

#include <openvdb/tree/LeafManager.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <optional>

#include "levelset/block.hpp"

namespace sidewall::levelset {
namespace {

using Leaves = openvdb::tree::LeafManager<const Grid::TreeType>;
using Samples = openvdb::tree::LeafManager<openvdb::Int32Tree>;
using B = Block<1>;

// Nodes this near to the front (in dx) look for their own surface point: every foot point, rounded to a node,
// is within sqrt(3)/2 of the front.
constexpr double kNear = 0.9;

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

// Ray first: in a smooth region the foot point lies along the gradient, and a ray costs a third of a search.
SurfaceSample find_sample(const surface::RayScene& scene, const Vec3& point, double phi, const Vec3& normal,
                          double dx) {
    const double slack = 0.25 * dx;
    const Vec3 direction = phi < 0.0 ? normal : Vec3(-normal);
    surface::SurfaceHit hit;
    if (normal != Vec3::Zero())
        hit = scene.closest_hit(point - slack * direction, direction, 0.0, std::abs(phi) + 2.0 * slack);
    if (!hit) hit = scene.closest_point(point, 2.0 * dx);
    if (!hit) hit = scene.closest_point(point, 1e30);
    return {hit.triangle, static_cast<float>(hit.u), static_cast<float>(hit.v), {}};
}

openvdb::Coord own_node(const Domain& domain, const openvdb::Coord& c) {
    return {domain.source_node(0, c.x()), domain.source_node(1, c.y()), c.z()};
}

// At a kink the gradient does not point at the foot: step to the neighbour nearest to the front instead,
// until one has a sample.
std::int32_t descend(const Grid::ConstUnsafeAccessor& phi,
                     const openvdb::tree::ValueAccessor<const openvdb::Int32Tree, false>& lookup,
                     const Domain& domain, openvdb::Coord c) {
    float distance = std::abs(phi.getValue(c));
    for (;;) {
        openvdb::Coord best = c;
        for (int n = 0; n < 27; ++n) {
            const openvdb::Coord q = own_node(domain, c.offsetBy(n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1));
            const float d = std::abs(phi.getValue(q));
            if (d < distance) {
                distance = d;
                best = q;
            }
        }
        const std::int32_t found = lookup.getValue(best);
        if (found >= 0 || best == c) return found;
        c = best;
    }
}

template <class FindSample>
Extension build(const Grid& grid, const Domain& domain, FindSample&& find) {
    Extension extension{{}, std::make_shared<openvdb::Int32Tree>(grid.tree(), -1, openvdb::TopologyCopy())};
    const double dx = domain.spacing;
    const auto near = static_cast<float>(kNear * dx);
    Leaves leaves(grid.tree());
    Samples samples(*extension.sample_of);
    std::vector<std::uint32_t> first(leaves.leafCount() + 1, 0);
    tbb::parallel_for(std::size_t{0}, leaves.leafCount(), [&](std::size_t n) {
        const Leaf& leaf = leaves.leaf(n);
        for (auto it = leaf.cbeginValueOn(); it; ++it) first[n + 1] += std::abs(*it) <= near;
    });
    for (std::size_t n = 0; n < leaves.leafCount(); ++n) first[n + 1] += first[n];
    extension.samples.resize(first.back());

    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.leafCount(), 4), [&](const auto& range) {
        const auto accessor = grid.getConstUnsafeAccessor();
        B block;
        for (std::size_t n = range.begin(); n != range.end(); ++n) {
            const Leaf& leaf = leaves.leaf(n);
            if (first[n] == first[n + 1]) continue;
            load_block(accessor, domain, leaf, grid.background(), block);
            auto& index = samples.leaf(n);
            std::uint32_t k = first[n];
            for (auto it = leaf.cbeginValueOn(); it; ++it) {
                if (std::abs(*it) > near) continue;
                const openvdb::Coord c = it.getCoord();
                const Vec3 point(domain.coordinate(0, c.x()), domain.coordinate(1, c.y()),
                                 domain.coordinate(2, c.z()));
                const int at = B::at(c.x() & 7, c.y() & 7, c.z() & 7);
                SurfaceSample& sample = extension.samples[k];
                sample = find(point, static_cast<double>(*it), gradient_direction(block, at));
                sample.node = c;
                index.setValueOnly(it.pos(), static_cast<std::int32_t>(k++));
            }
        }
    });

    // Far nodes: walk down the gradient to the foot point and take the sample of the node beside it. Written
    // to a second buffer, because neighbouring leaves are read meanwhile.
    samples.rebuildAuxBuffers(1);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.leafCount(), 4), [&](const auto& range) {
        const auto accessor = grid.getConstUnsafeAccessor();
        const openvdb::tree::ValueAccessor<const openvdb::Int32Tree, false> lookup(*extension.sample_of);
        B block;
        for (std::size_t n = range.begin(); n != range.end(); ++n) {
            const Leaf& leaf = leaves.leaf(n);
            load_block(accessor, domain, leaf, grid.background(), block);
            std::int32_t* out = samples.getBuffer(n, 1).data();
            for (auto it = leaf.cbeginValueOn(); it; ++it) {
                if (std::abs(*it) <= near) continue;
                const openvdb::Coord c = it.getCoord();
                const Vec3 foot = Vec3(c.x(), c.y(), c.z()) -
                                  static_cast<double>(*it) / dx *
                                      gradient_direction(block, B::at(c.x() & 7, c.y() & 7, c.z() & 7));
                const openvdb::Coord q = own_node(
                    domain, {static_cast<int>(std::lround(foot.x())), static_cast<int>(std::lround(foot.y())),
                             static_cast<int>(std::lround(foot.z()))});
                const std::int32_t found = lookup.getValue(q);
                out[it.pos()] = found >= 0 ? found : descend(accessor, lookup, domain, c);
            }
        }
    });
    samples.swapLeafBuffer(1);
    samples.removeAuxBuffers();
    return extension;
}

}  // namespace

Extension extend(const Grid& grid, const Domain& domain, const surface::RayScene& scene) {
    return build(grid, domain, [&](const Vec3& point, double phi, const Vec3& normal) {
        return find_sample(scene, point, phi, normal, domain.spacing);
    });
}

Extension extend_without_mesh(const Grid& grid, const Domain& domain) {
    return build(grid, domain, [](const Vec3&, double, const Vec3&) { return SurfaceSample{}; });
}

}  // namespace sidewall::levelset
