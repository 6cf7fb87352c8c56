#include "levelset/new_leaves.hpp"

#include <openvdb/tools/SignedFloodFill.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "levelset/band.hpp"
#include "levelset/openvdb_grid.hpp"
#include "surface/parallel.hpp"

namespace sidewall::levelset {
namespace {

bool has_distance(const Leaf& leaf, float background) {
    const float* v = leaf.buffer().data();
    return std::any_of(v, v + Leaf::SIZE, [&](float value) { return !(std::abs(value) >= background); });
}

// The active nodes of a new leaf that lie inside, by their neighbours of the old band in other leaves.
Nodes nodes_inside(const Leaf& leaf, const Band& band, float background, const Domain& domain) {
    const openvdb::Coord origin = leaf.origin();
    const bool inner =
        domain.owns(origin.x() - 1, origin.y() - 1) && domain.owns(origin.x() + 8, origin.y() + 8);
    const auto within = [](int n) { return n > 0 && n < 7; };
    Nodes inside;
    for (auto it = leaf.cbeginValueOn(); it; ++it) {
        const openvdb::Coord local = Leaf::offsetToLocalCoord(it.pos());
        if (inner && within(local.x()) && within(local.y()) && within(local.z())) continue;
        float side = 0.0f;
        for (int k = 0; k < 6; ++k) {
            openvdb::Coord q = origin + local;
            q[k / 2] += k % 2 ? 1 : -1;
            if (!inner) q.reset(domain.source_node(0, q.x()), domain.source_node(1, q.y()), q.z());
            if ((q & ~7) == origin) continue;
            const std::int32_t other = band.table.find(q.x() >> 3, q.y() >> 3, q.z() >> 3);
            if (other < 0) continue;
            const float v = band.leaves[static_cast<std::size_t>(other)]->getValue(q);
            if (std::abs(v) < background) side = v;
        }
        inside.set(it.pos(), std::signbit(side));
    }
    return inside;
}

}  // namespace

void sign_new_leaves(const Band& band, const Grid& grid, const Domain& domain) {
    const float background = grid.background();
    std::vector<std::uint8_t> is_new(band.leaves.size(), 0);
    surface::parallel_each(band.awake.size(), 128, [&](std::size_t k) {
        const std::size_t n = band.awake[k];
        is_new[n] = band.made[n] || !has_distance(*band.leaves[n], background);
    });
    std::vector<Leaf*> leaves;
    for (std::size_t n = 0; n < is_new.size(); ++n)
        if (is_new[n]) leaves.push_back(band.leaves[n]);
    // All are read before any is written: a voxel just reached has a neighbour of the old band, and another
    // new leaf's is to count for nothing whichever comes first.
    std::vector<Nodes> inside(leaves.size());
    tbb::parallel_for(std::size_t{0}, leaves.size(),
                      [&](std::size_t k) { inside[k] = nodes_inside(*leaves[k], band, background, domain); });
    const openvdb::tools::SignedFloodFillOp<Grid::TreeType> flood(grid.tree());
    // Just inside the background, so that the flood takes it for known.
    const float known = std::nextafter(background, 0.0f);
    tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t k) {
        for (auto it = leaves[k]->beginValueOn(); it; ++it)
            it.setValue(inside[k].isOn(it.pos()) ? -known : known);
        if (!leaves[k]->isEmpty()) flood(*leaves[k]);
    });
}

}  // namespace sidewall::levelset
