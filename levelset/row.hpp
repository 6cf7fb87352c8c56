#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

// Rows of eight nodes along z, the unit in which a leaf's values are computed: plain loops that compilers
// vectorise.
namespace sidewall::levelset {

inline constexpr int kLanes = 8;
using Row = std::array<float, kLanes>;

/// A selection of a row's eight nodes: all bits set or none.
using LaneMask = std::array<std::int32_t, kLanes>;

/// The mask of each pattern of eight bits. A table, as masks made lane by lane stall the loads that follow.
inline constexpr auto kLaneMasks = [] {
    std::array<LaneMask, 256> table{};
    for (std::size_t bits = 0; bits < table.size(); ++bits)
        for (std::size_t z = 0; z < kLanes; ++z) table[bits][z] = (bits >> z & 1) != 0 ? -1 : 0;
    return table;
}();

/// Writes the values of the selected nodes.
inline void blend(const Row& values, const LaneMask& where, float* to) {
    LaneMask from, kept;
    std::memcpy(from.data(), values.data(), sizeof from);
    std::memcpy(kept.data(), to, sizeof kept);
    for (std::size_t z = 0; z < kLanes; ++z) kept[z] ^= (kept[z] ^ from[z]) & where[z];
    std::memcpy(to, kept.data(), sizeof kept);
}

}  // namespace sidewall::levelset
