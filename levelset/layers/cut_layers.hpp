#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "levelset/large_vector.hpp"
#include "levelset/layers/stack.hpp"
#include "levelset/openvdb_grid.hpp"
#include "surface/extraction/leaf_table.hpp"

namespace sidewall::levelset {

/// A set of a leaf's nodes, bit z of row 8 x + y: like Nodes, but not initialised where many are made.
using RowBits = std::array<std::uint8_t, 64>;

inline bool has(const RowBits& bits, std::size_t node) {
    return (bits[node >> 3] >> (node & 7) & 1) != 0;
}

/// Nodes of a surface that moved outwards in a time step.
struct Grown {
    const surface::LeafTable& table;  ///< of the surface's leaves
    LargeVector<RowBits> nodes;       ///< by leaf

    /// The nodes of the surface's leaf at \p origin; null if there is no such leaf.
    const RowBits* in(const openvdb::Coord& origin) const {
        const std::int32_t leaf = table.find(origin.x() >> 3, origin.y() >> 3, origin.z() >> 3);
        return leaf < 0 ? nullptr : &nodes[static_cast<std::size_t>(leaf)];
    }
};

/// Marks nodes of lower layers, exposed before a time step, where the surface did not move outwards.
/// cut_layers gives them the surface's values, so that no change by re-distancing counts as a film on them.
/// Nodes beside a piece of their layer's front that a film grows over are not marked: that front stays.
///
/// \param leaves  those of the surface, which has moved and is not re-distanced yet.
/// \param table   table of the leaves, kept by the result.
/// \param before  the leaves' values at the time step's start, Leaf::SIZE per leaf.
/// \returns the nodes at which the surface moved outwards.
/// \note Parallel; O(n) in voxels.
Grown mark_exposed(MaterialStack& stack, std::span<Leaf* const> leaves, const surface::LeafTable& table,
                   const float* before);

/// Cuts every layer by the surface after it moved. Layers nearer to it than thinnest_film then coincide with
/// it, except at \p grown nodes: a film may grow by less than that in a time step.
void cut_layers(MaterialStack& stack, const Grown* grown = nullptr);

}  // namespace sidewall::levelset
