#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "levelset/domain.hpp"
#include "levelset/openvdb_grid.hpp"
#include "surface/extraction/leaf_table.hpp"

namespace sidewall::levelset {

/// One leaf's values with R layers of neighbours on every side, ghosts included, in a flat array: stencils
/// become constant strides. z is contiguous.
template <int R>
struct Block {
    static constexpr int kSide = 8 + 2 * R;
    static constexpr int kStride[3] = {kSide * kSide, kSide, 1};
    std::array<float, static_cast<std::size_t>(kSide* kSide* kSide)> value;

    /// Position of leaf-local node (x, y, z), each in [-R, 8+R).
    static constexpr int at(int x, int y, int z) { return ((x + R) * kSide + y + R) * kSide + z + R; }
};

/// Pointers to the values of a grid's leaves, found by leaf coordinates.
struct LeafData {
    const surface::LeafTable& table;  ///< of the leaves
    std::vector<const float*> values;

    template <class LeafPointer>
    LeafData(const surface::LeafTable& of, const std::vector<LeafPointer>& leaves) : table(of) {
        values.reserve(leaves.size());
        for (const Leaf* leaf : leaves) values.push_back(leaf->buffer().data());
    }
    /// Values of the leaf at leaf coordinates (nodes / 8); nullptr if there is none.
    const float* find(int x, int y, int z) const {
        const std::int32_t n = table.find(x, y, z);
        return n < 0 ? nullptr : values[static_cast<std::size_t>(n)];
    }
};

/// Fills \p block from \p leaf and its neighbours. A missing neighbour leaf is outside the band: its nodes
/// get the background with the sign of the nearest node of a leaf that exists.
template <int R>
void load_block(const LeafData& leaves, const Domain& domain, const Leaf& leaf, float background,
                Block<R>& block) {
    static_assert(R <= 4);
    const openvdb::Coord origin = leaf.origin();
    const int x0 = origin.x() >> 3, y0 = origin.y() >> 3, z0 = origin.z() >> 3;
    // The 27 leaves around, found once. A ghost's source node may lie in another leaf, found when needed.
    std::array<const float*, 27> around;
    for (int x = -1, n = 0; x <= 1; ++x)
        for (int y = -1; y <= 1; ++y)
            for (int z = -1; z <= 1; ++z, ++n)
                around[static_cast<std::size_t>(n)] = leaves.find(x0 + x, y0 + y, z0 + z);
    // Whether no node that is read is a ghost, as for most leaves.
    const bool inner =
        domain.owns(origin.x() - R, origin.y() - R) && domain.owns(origin.x() + 7 + R, origin.y() + 7 + R);
    const auto own = [&](int axis, int node) { return inner ? node : domain.source_node(axis, node); };
    std::array<int, 8 + 2 * R> own_y;
    for (int y = -R; y < 8 + R; ++y) own_y[static_cast<std::size_t>(y + R)] = own(1, origin.y() + y);
    for (int x = -R; x < 8 + R; ++x) {
        const int i = own(0, origin.x() + x);
        const int leaf_x = (i >> 3) - x0;
        for (int y = -R; y < 8 + R; ++y) {
            const int j = own_y[static_cast<std::size_t>(y + R)];
            const int leaf_y = (j >> 3) - y0;
            const bool near = std::abs(leaf_x) <= 1 && std::abs(leaf_y) <= 1;
            // A column of 8 + 2R nodes along z passes through three leaves, contiguous in each.
            const auto run = [&](int leaf_z) -> const float* {
                const float* source =
                    near ? around[static_cast<std::size_t>((leaf_x + 1) * 9 + (leaf_y + 1) * 3 + leaf_z + 1)]
                         : leaves.find(i >> 3, j >> 3, z0 + leaf_z);
                return source ? source + ((i & 7) << 6 | (j & 7) << 3) : nullptr;
            };
            float* column = &block.value[static_cast<std::size_t>(Block<R>::at(x, y, 0))];
            const float* middle = run(0);
            const float* below = run(-1);
            const float* above = run(1);
            if (middle) {
                std::memcpy(column, middle, 8 * sizeof(float));
            } else {
                // Sign of the nearest node of the centre leaf: the missing leaf lies wholly on its side of
                // the front.
                const int cx = std::clamp(x, 0, 7), cy = std::clamp(y, 0, 7);
                const float* nearest = around[13] + (cx << 6 | cy << 3);
                for (int z = 0; z < 8; ++z) column[z] = std::copysign(background, nearest[z]);
            }
            for (int z = 1; z <= R; ++z) {
                column[-z] = below ? below[8 - z] : std::copysign(background, column[0]);
                column[7 + z] = above ? above[z - 1] : std::copysign(background, column[7]);
            }
        }
    }
}

/// Fills \p block like load_block, but only the nodes that stencils along the axes reach from the leaf's own
/// nodes. Takes half the time.
template <int R>
void load_axes(const LeafData& leaves, const Domain& domain, const Leaf& leaf, float background,
               Block<R>& block) {
    static_assert(R <= 4);
    const openvdb::Coord origin = leaf.origin();
    const int x0 = origin.x() >> 3, y0 = origin.y() >> 3, z0 = origin.z() >> 3;
    const float* own = leaves.find(x0, y0, z0);
    const float* const below = leaves.find(x0, y0, z0 - 1);
    const float* const above = leaves.find(x0, y0, z0 + 1);
    const float* const beside[4] = {leaves.find(x0 - 1, y0, z0), leaves.find(x0, y0 - 1, z0),
                                    leaves.find(x0, y0 + 1, z0), leaves.find(x0 + 1, y0, z0)};
    const bool inner =
        domain.owns(origin.x() - R, origin.y() - R) && domain.owns(origin.x() + 7 + R, origin.y() + 7 + R);
    std::array<int, 8 + 2 * R> nodes_x, nodes_y;
    for (int k = -R; k < 8 + R; ++k) {
        const auto n = static_cast<std::size_t>(k + R);
        nodes_x[n] = inner ? origin.x() + k : domain.source_node(0, origin.x() + k);
        nodes_y[n] = inner ? origin.y() + k : domain.source_node(1, origin.y() + k);
    }
    const auto leaf_at = [&](int x, int y) {
        if (x == 0 && y == 0) return own;
        if (std::abs(x) + std::abs(y) == 1) return beside[x == 0 ? 1 + (y > 0) : 3 * (x > 0)];
        return leaves.find(x0 + x, y0 + y, z0);
    };
    for (int x = -R; x < 8 + R; ++x) {
        const int i = nodes_x[static_cast<std::size_t>(x + R)];
        const bool in_x = x >= 0 && x < 8;
        for (int y = in_x ? -R : 0; y < (in_x ? 8 + R : 8); ++y) {
            const int j = nodes_y[static_cast<std::size_t>(y + R)];
            const float* source = leaf_at((i >> 3) - x0, (j >> 3) - y0);
            float* column = &block.value[static_cast<std::size_t>(Block<R>::at(x, y, 0))];
            if (source) {
                std::memcpy(column, source + ((i & 7) << 6 | (j & 7) << 3), 8 * sizeof(float));
            } else {  // see load_block
                const float* nearest = own + (std::clamp(x, 0, 7) << 6 | std::clamp(y, 0, 7) << 3);
                for (int z = 0; z < 8; ++z) column[z] = std::copysign(background, nearest[z]);
            }
        }
        if (!in_x) continue;
        for (int y = 0; y < 8; ++y) {
            float* column = &block.value[static_cast<std::size_t>(Block<R>::at(x, y, 0))];
            const int row = x << 6 | y << 3;
            for (int z = 1; z <= R; ++z) {
                column[-z] = below ? below[row + 8 - z] : std::copysign(background, column[0]);
                column[7 + z] = above ? above[row + z - 1] : std::copysign(background, column[7]);
            }
        }
    }
}

}  // namespace sidewall::levelset
