#pragma once
#include <openvdb/math/BBox.h>
#include <openvdb/math/Coord.h>

#include <array>
#include <cstdint>
#include <vector>

namespace sidewall::surface {

/// Look-up table of leaf numbers by place: a dense box of leaf coordinates (nodes / 8).
class LeafTable {
  public:
    LeafTable() = default;
    /// \param leaves  pointers to leaves of one tree, of any value type.
    template <class LeafPointer>
    explicit LeafTable(const std::vector<LeafPointer>& leaves) {
        openvdb::CoordBBox box;
        for (const auto* leaf : leaves) box.expand(leaf->origin());
        if (leaves.empty()) return;
        for (int a = 0; a < 3; ++a) {
            const auto k = static_cast<std::size_t>(a);
            low_[k] = box.min()[a] >> 3;
            size_[k] = (box.max()[a] >> 3) - low_[k] + 1;
        }
        number_.assign(static_cast<std::size_t>(size_[0]) * static_cast<std::size_t>(size_[1]) *
                           static_cast<std::size_t>(size_[2]),
                       -1);
        for (std::size_t n = 0; n < leaves.size(); ++n) {
            const openvdb::Coord o = leaves[n]->origin();
            number_[at(o.x() >> 3, o.y() >> 3, o.z() >> 3)] = static_cast<std::int32_t>(n);
        }
    }

    /// Number of the leaf at leaf coordinates, -1 if there is none.
    std::int32_t find(int x, int y, int z) const {
        const bool in = x >= low_[0] && y >= low_[1] && z >= low_[2] && x < low_[0] + size_[0] &&
                        y < low_[1] + size_[1] && z < low_[2] + size_[2];
        return in ? number_[at(x, y, z)] : -1;
    }

    /// First leaf coordinate along an axis, and how many there are.
    int low(std::size_t axis) const { return low_[axis]; }
    int size(std::size_t axis) const { return size_[axis]; }

  private:
    std::size_t at(int x, int y, int z) const {
        return (static_cast<std::size_t>(x - low_[0]) * static_cast<std::size_t>(size_[1]) +
                static_cast<std::size_t>(y - low_[1])) *
                   static_cast<std::size_t>(size_[2]) +
               static_cast<std::size_t>(z - low_[2]);
    }

    std::array<int, 3> low_{}, size_{};
    std::vector<std::int32_t> number_;
};

}  // namespace sidewall::surface
