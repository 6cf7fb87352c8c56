#include "levelset/grid_leaves.hpp"

#include <algorithm>
#include <array>
#include <map>

namespace sidewall::levelset {
namespace {

// The order of the leaves of a tree: by their places in its root, its nodes and their nodes.
bool before(const Leaf* a, const Leaf* b) {
    const auto place = [](const openvdb::Coord& c) {
        return std::array{c.x() >> 12, c.y() >> 12, c.z() >> 12, c.x() >> 7, c.y() >> 7,
                          c.z() >> 7,  c.x() >> 3,  c.y() >> 3,  c.z() >> 3};
    };
    return place(a->origin()) < place(b->origin());
}

}  // namespace

GridLeaves::GridLeaves(const Grid& grid, const Domain& domain, const NodeValues& other)
    : background_(grid.background()) {
    grid.tree().getNodes(list_);
    set(other);
    for (int axis = 0; axis < 2; ++axis)
        if (const auto a = static_cast<std::size_t>(axis); domain.side[a] == Side::periodic)
            set(images(axis, domain.cells[a]));
    if (!own_.empty()) std::sort(list_.begin(), list_.end(), before);
}

NodeValues GridLeaves::images(int axis, int cells) const {
    NodeValues images;
    const Nodes low_side = nodes_in_plane(axis, 0);
    for (const Leaf* leaf : list_) {
        if (leaf->origin()[axis] != 0) continue;
        const Nodes on_side = leaf->getValueMask() & low_side;
        for (auto it = on_side.beginOn(); it; ++it) {
            openvdb::Coord c = leaf->offsetToGlobalCoord(it.pos());
            c[axis] = cells;
            images.emplace_back(c, leaf->getValue(it.pos()));
        }
    }
    return images;
}

void GridLeaves::set(const NodeValues& values) {
    if (values.empty()) return;
    std::map<openvdb::Coord, Leaf*> to;  // by origin
    openvdb::CoordBBox box;              // of their leaves
    for (const auto& leaf : own_) to[leaf->origin()] = leaf.get();
    auto at = to.end();  // most have the leaf of the one before
    const auto go_to = [&](const openvdb::Coord& origin) {
        if (at == to.end() || at->first != origin) at = to.try_emplace(at, origin, nullptr);
    };
    for (const auto& [c, v] : values) {
        go_to(c & ~7);
        box.expand(at->first);
    }
    for (const Leaf*& leaf : list_) {
        if (!box.isInside(leaf->origin())) continue;
        const auto copied = to.find(leaf->origin());
        if (copied == to.end() || copied->second != nullptr) continue;
        leaf = copied->second = own_.emplace_back(std::make_unique<Leaf>(*leaf)).get();
    }
    for (auto& [origin, leaf] : to)
        if (leaf == nullptr)
            list_.push_back(leaf =
                                own_.emplace_back(std::make_unique<Leaf>(origin, background_, false)).get());
    for (const auto& [c, v] : values) {
        go_to(c & ~7);
        at->second->setValueOn(c, v);
    }
}

}  // namespace sidewall::levelset
