#include "levelset/openvdb_grid.hpp"

#include <algorithm>
#include <cmath>

namespace sidewall::levelset {

bool inside(const Grid& grid, const openvdb::Coord& ijk) {
    const auto accessor = grid.getConstUnsafeAccessor();
    openvdb::CoordBBox range;  // of the root's children: cheap, and no leaf lies beyond
    grid.tree().getIndexRange(range);
    for (openvdb::Coord c = ijk; c.z() <= range.max().z();) {
        if (const Leaf* leaf = accessor.probeConstLeaf(c)) return leaf->getValue(c) < 0.0f;
        // On to the next leaf that can exist: past the whole tree node that is missing here.
        constexpr int kSize[] = {4096, 128, 8};
        const int size = kSize[std::clamp(accessor.getValueDepth(c), 0, 2)];
        c.setZ((c.z() & ~(size - 1)) + size);
    }
    return false;
}

NodeEdge edge_at(const Vec3& index) {
    NodeEdge edge;
    double off = -1.0;
    for (int a = 0; a < 3; ++a) {
        edge.low[a] = static_cast<int>(std::lround(index[a]));
        if (const double distance = std::abs(index[a] - edge.low[a]); distance > off)
            off = distance, edge.axis = a;
    }
    edge.low[edge.axis] = static_cast<int>(std::floor(index[edge.axis]));
    return edge;
}

bool trim_leaf(Leaf& leaf, const Domain& domain, float background) {
    float* value = leaf.buffer().data();
    const openvdb::Coord origin = leaf.origin();
    const bool all_own = domain.owns(origin.x(), origin.y()) && domain.owns(origin.x() + 7, origin.y() + 7);
    for (auto it = leaf.beginValueOn(); it; ++it) {
        const openvdb::Index n = it.pos();
        const bool own = all_own || domain.owns(origin.x() + static_cast<int>(n >> 6),
                                                origin.y() + static_cast<int>(n >> 3 & 7));
        if (own && std::abs(value[n]) < background) continue;
        value[n] = std::copysign(background, value[n]);
        leaf.setValueOff(n);
    }
    return !leaf.isEmpty();
}

}  // namespace sidewall::levelset
