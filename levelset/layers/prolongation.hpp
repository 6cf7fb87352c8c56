#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "levelset/layers/stack.hpp"

// How the values of one level come from those of the next.
namespace sidewall::levelset {

/// The source of the values of a level's leaves, by column of leaves (8 nodes wide).
enum class LeafColumn : std::uint8_t {
    none,          ///< there are no leaves
    interpolated,  ///< they are made of the coarser level's
    kept
};

struct LeafColumns {
    std::array<int, 2> count{};
    std::vector<LeafColumn> source;  ///< by column, y fastest

    LeafColumn& at(int x, int y) { return source[static_cast<std::size_t>(x * count[1] + y)]; }
    LeafColumn at(int x, int y) const { return source[static_cast<std::size_t>(x * count[1] + y)]; }
};

/// Interpolates a level's leaves from those of stack.coarser where \p columns say so: shared nodes take the coarser
/// values, those between cubics of four nodes along each axis, or linear means where these reach beyond the narrow band. No
/// lower layer comes to lie above the one over it.
/// \note Parallel; O(n) in the leaves made.
void prolongate(MaterialStack& stack, const LeafColumns& columns);

/// Injection: gives stack.coarser the values of this level in \p columns of this level. Where the coarser one's narrow band is wider
/// it keeps its own, on the side where this level has the front.
void inject(MaterialStack& stack, const LevelColumns& columns);

}  // namespace sidewall::levelset
