#include "surface/extraction/bent_nodes.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <tuple>
#include <utility>

#include "surface/extraction/crossing_planes.hpp"

namespace sidewall::surface {
namespace {

constexpr float kBend = 0.2f;
constexpr float kFar = 2.0f;  // cells: no corner of a cell that the surface cuts is farther from it

using Row = Eigen::Array<float, 8, 1>;  // of nodes along z
using RowMap = Eigen::Map<const Row>;
using RowMutable = Eigen::Map<Row>;

// Rows of a leaf and of those across its faces, at own nodes and at images beyond a periodic side.
class LeafRows {
  public:
    LeafRows(const CutLeaves& leaves, const LateralGrid& box, std::size_t n)
        : leaves_(leaves),
          reader_(leaves, box),
          box_(box),
          origin_(leaves.leaf(n).origin()),
          own_(values(&leaves.leaf(n))) {
        for (int axis = 0; axis < 3; ++axis)
            for (const int way : {0, 1}) {
                openvdb::Coord beside = origin_;
                beside[axis] += way == 0 ? -8 : 8;
                beside_[axis][way] = values(leaves.leaf_at(beside));
            }
    }
    Row at(int x, int y) const {
        return repeats(x, y) ? source(x, y, 0, Row::Constant(2.0f * kFar * static_cast<float>(box_.spacing)))
                             : own(x, y);
    }
    /// The neighbouring row along x (0) or y (1), down (0) or up (1), mirrored at reflective sides; where it
    /// is unknown, this row.
    Row next(int x, int y, int axis, int way) const {
        int c[2] = {x, y};
        c[axis] += way == 0 ? -1 : 1;
        const int node = origin_[axis] + c[axis];
        const auto a = static_cast<std::size_t>(axis);
        if (!box_.periodic[a] && (node < 0 || node > box_.cells[a])) return next(x, y, axis, 1 - way);
        if (repeats(c[0], c[1])) return source(c[0], c[1], 0, at(x, y));
        const bool is_own = c[axis] >= 0 && c[axis] < 8;
        const float* leaf = is_own ? own_ : beside_[axis][way];
        return leaf ? Row(RowMap(leaf + ((c[0] & 7) << 6 | (c[1] & 7) << 3))) : at(x, y);
    }
    /// The values below and above a row; its own first and last one where these are not known.
    std::pair<float, float> ends(int x, int y) const {
        const Row row = at(x, y);
        if (repeats(x, y))
            return {source(x, y, -1, Row::Constant(row[0]))[7], source(x, y, 1, Row::Constant(row[7]))[0]};
        return {beside_[2][0] ? beside_[2][0][(x << 6 | y << 3) + 7] : row[0],
                beside_[2][1] ? beside_[2][1][x << 6 | y << 3] : row[7]};
    }

  private:
    static const float* values(const FloatLeaf* leaf) { return leaf ? leaf->buffer().data() : nullptr; }
    Row own(int x, int y) const { return RowMap(own_ + (x << 6 | y << 3)); }
    // Whether a row lies beyond a periodic side and repeats another one.
    bool repeats(int x, int y) const {
        const auto beyond = [&](std::size_t a, int node) {
            return box_.periodic[a] && (node < 0 || node >= box_.cells[a]);
        };
        return beyond(0, origin_.x() + x) || beyond(1, origin_.y() + y);
    }
    // The row that one repeats, \p up leaves higher; \p unknown where there is no leaf.
    Row source(int x, int y, int up, const Row& unknown) const {
        const openvdb::Coord node = reader_.source(origin_ + openvdb::Coord(x, y, 8 * up));
        const float* leaf = values(leaves_.leaf_at(node & ~7));
        return leaf ? Row(RowMap(leaf + ((node.x() & 7) << 6 | (node.y() & 7) << 3))) : unknown;
    }

    const CutLeaves& leaves_;
    NodeReader reader_;
    const LateralGrid& box_;
    openvdb::Coord origin_;
    const float* own_;
    const float* beside_[3][2];
};

}  // namespace

NodeBits bent_nodes(const CutLeaves& leaves, const LateralGrid& box, std::size_t n) {
    const LeafRows rows(leaves, box, n);
    const float limit = kBend * static_cast<float>(box.spacing), far = kFar * static_cast<float>(box.spacing);
    const openvdb::Coord o = leaves.leaf(n).origin();
    const int last_x = std::min(7, box.cells[0] - o.x()), last_y = std::min(7, box.cells[1] - o.y());
    // The leaf's nodes in the domain and one more on each side, copied once.
    constexpr int kZ = 4;  // place of z = 0 in a row, aligned
    alignas(32) float value[10][10][8 + 2 * kZ];
    const auto put = [&](int x, int y, const Row& row) {
        RowMutable to(&value[x + 1][y + 1][kZ]);
        to = row;
    };
    for (int x = 0; x <= last_x; ++x)
        for (int y = 0; y <= last_y; ++y) {
            put(x, y, rows.at(x, y));
            std::tie(value[x + 1][y + 1][kZ - 1], value[x + 1][y + 1][kZ + 8]) = rows.ends(x, y);
        }
    for (int y = 0; y <= last_y; ++y)
        put(-1, y, rows.next(0, y, 0, 0)), put(last_x + 1, y, rows.next(last_x, y, 0, 1));
    for (int x = 0; x <= last_x; ++x)
        put(x, -1, rows.next(x, 0, 1, 0)), put(x, last_y + 1, rows.next(x, last_y, 1, 1));
    NodeBits bent{};
    for (int x = 0; x <= last_x; ++x) {
        // Above 0 where the surface bends and is near enough for a corner of a cell that it cuts.
        Row excess[8], most = Row::Constant(-1.0f);
        for (int y = 0; y <= last_y; ++y) {
            const auto row = [&](int i, int j, int k) {
                return RowMap(&value[x + 1 + i][y + 1 + j][kZ + k]);
            };
            const Row own = row(0, 0, 0), twice = 2.0f * own;
            const Row along_x = row(-1, 0, 0) + row(1, 0, 0) - twice,
                      along_y = row(0, -1, 0) + row(0, 1, 0) - twice,
                      along_z = row(0, 0, -1) + row(0, 0, 1) - twice;
            const Row bend = along_x.abs().max(along_y.abs()).max(along_z.abs());
            excess[y] = (bend - limit).min(far - own.abs());
            most = most.max(excess[y]);
        }
        if (!(most.maxCoeff() > 0.0f)) continue;
        for (int y = 0; y <= last_y; ++y) {
            unsigned bits = 0;
            for (int z = 0; z < 8; ++z) bits |= static_cast<unsigned>(excess[y][z] > 0.0f) << z;
            bent[static_cast<std::size_t>(x << 3 | y)] = static_cast<std::uint8_t>(bits);
        }
    }
    return bent;
}

}  // namespace sidewall::surface
