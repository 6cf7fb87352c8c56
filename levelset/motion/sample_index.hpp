#pragma once
#include <cstdint>
#include <limits>
#include <vector>

#include "levelset/large_vector.hpp"
#include "levelset/openvdb_grid.hpp"
#include "surface/extraction/leaf_table.hpp"

namespace sidewall::levelset {

/// By node of a grid's leaves: the surface sample that gives the node its speed. A node next to the front has
/// a sample, whose number is its entry. A node farther out shares one: its entry has kShared set besides.
class SampleIndex {
  public:
    static constexpr std::int32_t kShared = std::numeric_limits<std::int32_t>::min();
    static constexpr std::int32_t kNone = -1;  ///< off the band, or far from any sample

    /// Leaves the entries unset.
    explicit SampleIndex(const std::vector<const Leaf*>& leaves)
        : table_(leaves), entry_(leaves.size() * Leaf::SIZE), stride_(Leaf::SIZE) {}
    /// Chooses one sample for all nodes.
    struct Uniform {};
    SampleIndex(const std::vector<const Leaf*>& leaves, Uniform) : table_(leaves), entry_(Leaf::SIZE, 0) {}

    /// Number of an entry's sample, negative if there is none.
    static std::int32_t sample(std::int32_t entry) { return entry == kNone ? kNone : entry & ~kShared; }

    /// Leaf::SIZE entries of a leaf.
    std::int32_t* of(std::size_t leaf) { return &entry_[leaf * stride_]; }
    /// Entries of the leaf at leaf coordinates (nodes / 8); nullptr if there is no such leaf.
    const std::int32_t* find(int x, int y, int z) const {
        const std::int32_t leaf = table_.find(x, y, z);
        return leaf < 0 ? nullptr : &entry_[static_cast<std::size_t>(leaf) * stride_];
    }
    const std::int32_t* find(const openvdb::Coord& node) const {
        return find(node.x() >> 3, node.y() >> 3, node.z() >> 3);
    }
    /// Number of a node's sample.
    std::int32_t at(const openvdb::Coord& node) const {
        const std::int32_t* entries = find(node);
        return entries ? sample(entries[Leaf::coordToOffset(node)]) : kNone;
    }

    const surface::LeafTable& table() const { return table_; }

  private:
    surface::LeafTable table_;
    LargeVector<std::int32_t> entry_;
    std::size_t stride_ = 0;
};

}  // namespace sidewall::levelset
