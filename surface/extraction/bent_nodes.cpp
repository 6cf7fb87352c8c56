#include "surface/extraction/bent_nodes.hpp"

#include <Eigen/Core>

#include "surface/extraction/crossing_planes.hpp"

namespace sidewall::surface {
namespace {

constexpr float kBend = 0.2f;
constexpr float kFar = 2.0f;  // cells: no corner of a cell that the surface cuts is farther from it

using Row = Eigen::Array<float, 8, 1>;  // of nodes along z
using RowMap = Eigen::Map<const Row>;

// The rows of a leaf and those across its faces.
class LeafRows {
  public:
    LeafRows(const CutLeaves& leaves, const LateralGrid& box, std::size_t n)
        : reader_(leaves, box), box_(box), origin_(leaves.leaf(n).origin()), own_(values(&leaves.leaf(n))) {
        for (int axis = 0; axis < 3; ++axis)
            for (const int way : {0, 1}) {
                openvdb::Coord beside = origin_;
                beside[axis] += way == 0 ? -8 : 8;
                beside_[axis][way] = values(leaves.leaf_at(beside));
            }
    }
    Row at(int x, int y) const { return RowMap(own_ + (x << 6 | y << 3)); }
    /// The row one farther along x (0) or y (1), down (0) or up (1); this one again where that is not known.
    Row next(int x, int y, int axis, int way) {
        int c[2] = {x, y};
        c[axis] += way == 0 ? -1 : 1;
        const int node = origin_[axis] + c[axis];
        const auto a = static_cast<std::size_t>(axis);
        if (node < 0 || node > box_.cells[a])
            return box_.periodic[a] ? beyond(c[0], c[1]) : next(x, y, axis, 1 - way);  // mirrored
        const bool own = c[axis] >= 0 && c[axis] < 8;
        const float* leaf = own ? own_ : beside_[axis][way];
        return leaf ? Row(RowMap(leaf + ((c[0] & 7) << 6 | (c[1] & 7) << 3))) : at(x, y);
    }
    /// The second difference along z.
    Row along_z(int x, int y) const {
        const int row = x << 6 | y << 3;
        float v[10];
        for (int z = 0; z < 8; ++z) v[z + 1] = own_[row + z];
        v[0] = beside_[2][0] ? beside_[2][0][row + 7] : v[1];
        v[9] = beside_[2][1] ? beside_[2][1][row] : v[8];
        return RowMap(v) + RowMap(v + 2) - 2.0f * RowMap(v + 1);
    }

  private:
    static const float* values(const FloatLeaf* leaf) { return leaf ? leaf->buffer().data() : nullptr; }
    Row beyond(int x, int y) {
        Row row;
        for (int z = 0; z < 8; ++z)
            row[z] = static_cast<float>(reader_(origin_ + openvdb::Coord(x, y, z)) * box_.spacing);
        return row;
    }

    NodeReader reader_;
    const LateralGrid& box_;
    openvdb::Coord origin_;
    const float* own_;
    const float* beside_[3][2];
};

}  // namespace

NodeBits bent_nodes(const CutLeaves& leaves, const LateralGrid& box, std::size_t n) {
    LeafRows rows(leaves, box, n);
    const float limit = kBend * static_cast<float>(box.spacing);
    NodeBits bent{};
    const openvdb::Coord o = leaves.leaf(n).origin();
    for (int x = 0; x < 8 && o.x() + x <= box.cells[0]; ++x)
        for (int y = 0; y < 8 && o.y() + y <= box.cells[1]; ++y) {
            const Row row = rows.at(x, y), twice = 2.0f * row;
            if (row.abs().minCoeff() > kFar * static_cast<float>(box.spacing)) continue;
            const Row along_x = rows.next(x, y, 0, 0) + rows.next(x, y, 0, 1) - twice,
                      along_y = rows.next(x, y, 1, 0) + rows.next(x, y, 1, 1) - twice;
            const Row bend = along_x.abs().max(along_y.abs()).max(rows.along_z(x, y).abs());
            if (!(bend.maxCoeff() > limit)) continue;
            unsigned bits = 0;
            for (int z = 0; z < 8; ++z) bits |= static_cast<unsigned>(bend[z] > limit) << z;
            bent[static_cast<std::size_t>(x << 3 | y)] = static_cast<std::uint8_t>(bits);
        }
    return bent;
}

}  // namespace sidewall::surface
