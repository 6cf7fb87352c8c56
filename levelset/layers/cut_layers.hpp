#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "levelset/large_vector.hpp"
#include "levelset/layers/stack.hpp"
#include "levelset/openvdb_grid.hpp"
#include "surface/extraction/leaf_table.hpp"

namespace sidewall::levelset {

/// Some nodes of a leaf, as Nodes but left as they are where many are made: bit z of row 8 x + y.
using RowBits = std::array<std::uint8_t, 64>;

inline bool has(const RowBits& bits, std::size_t node) {
    return (bits[node >> 3] >> (node & 7) & 1) != 0;
}

/// Nodes of a surface that moved outwards in a time step.
struct Grown {
    const surface::LeafTable& table;  ///< of the surface's leaves
    LargeVector<RowBits> nodes;       ///< by leaf

    /// The nodes of the leaf at an origin; null if it was none of the surface's.
    const RowBits* in(const openvdb::Coord& origin) const {
        const std::int32_t leaf = table.find(origin.x() >> 3, origin.y() >> 3, origin.z() >> 3);
        return leaf < 0 ? nullptr : &nodes[static_cast<std::size_t>(leaf)];
    }
};

/// Releases the nodes of lower layers that were bare before a time step and did not grow, for cut_layers to set: they
/// follow the surface, and nothing that re-distancing changes there can come to lie on them. Not so beside a piece of
/// their layer's front that a film grows over: the surface leaves it, and the layer's front stays.
///
/// \param leaves  of the surface, which has moved and is not re-distanced yet.
/// \param table   of the leaves, kept by the result.
/// \param before  their values at the time step's start, Leaf::SIZE a leaf.
/// \returns the nodes that grew.
/// \note Parallel; O(n) in voxels.
Grown release_exposed(MaterialStack& stack, std::span<Leaf* const> leaves, const surface::LeafTable& table,
                      const float* before);

/// Cuts every layer by the surface after it moved. Layers nearer to it than thinnest_film coincide with it from
/// then on, but for \p grown nodes: a film may grow by less than that in a time step.
void cut_layers(MaterialStack& stack, const Grown* grown = nullptr);

}  // namespace sidewall::levelset
