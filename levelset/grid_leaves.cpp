#include "levelset/grid_leaves.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>

#include "surface/extraction/leaf_table.hpp"

namespace sidewall::levelset {
namespace {

// Tree order of leaves: by child of the root (4096 nodes wide), then inner node (128), then leaf (8).
bool before(const Leaf* a, const Leaf* b) {
    const auto place = [](const openvdb::Coord& c) {
        return std::array{c.x() >> 12, c.y() >> 12, c.z() >> 12, c.x() >> 7, c.y() >> 7,
                          c.z() >> 7,  c.x() >> 3,  c.y() >> 3,  c.z() >> 3};
    };
    return place(a->origin()) < place(b->origin());
}

}  // namespace

surface::LateralGrid lateral_grid(const Domain& domain, std::span<const surface::CellColumn> columns) {
    return {domain.min,
            domain.max,
            domain.cells,
            domain.spacing,
            columns,
            {domain.side[0] == Side::periodic, domain.side[1] == Side::periodic},
            kOnFront * domain.spacing};
}

GridLeaves::GridLeaves(const Grid& grid, const Domain& domain, const NodeValues& other)
    : background_(grid.background()) {
    grid.tree().getNodes(list_);
    const auto in_grid = static_cast<std::ptrdiff_t>(list_.size());
    set(other);
    for (int axis = 0; axis < 2; ++axis)
        if (const auto a = static_cast<std::size_t>(axis); domain.side[a] == Side::periodic)
            set_images(axis, domain.cells[a]);
    std::sort(list_.begin() + in_grid, list_.end(), before);
    std::inplace_merge(list_.begin(), list_.begin() + in_grid, list_.end(), before);
}

void GridLeaves::set_images(int axis, int cells) {
    const Nodes low_side = nodes_in_plane(axis, 0);
    const auto ahead = static_cast<openvdb::Index>((cells & 7) << (6 - 3 * axis));
    const surface::LeafTable table(list_);
    for (std::size_t n = 0, count = list_.size(); n < count; ++n) {
        const Leaf& leaf = *list_[n];
        openvdb::Coord o = leaf.origin();
        if (o[axis] != 0) continue;
        const Nodes on_side = leaf.getValueMask() & low_side;
        if (on_side.isOff()) continue;
        o[axis] = cells & ~7;
        const std::int32_t at = table.find(o.x() >> 3, o.y() >> 3, o.z() >> 3);
        const Leaf*& entry = at < 0 ? list_.emplace_back() : list_[static_cast<std::size_t>(at)];
        Leaf* copy = own_.emplace_back(at < 0 ? std::make_unique<Leaf>(o, background_, false)
                                              : std::make_unique<Leaf>(*entry))
                         .get();
        for (auto it = on_side.beginOn(); it; ++it)
            copy->setValueOn(it.pos() + ahead, leaf.getValue(it.pos()));
        entry = copy;
    }
}

void GridLeaves::set(const NodeValues& values) {
    if (values.empty()) return;
    std::map<openvdb::Coord, Leaf*> to;  // by origin
    openvdb::CoordBBox box;              // of their leaves
    auto at = to.end();                  // most nodes lie in the leaf of the node before
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
        if (copied == to.end()) continue;
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
