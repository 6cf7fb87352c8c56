#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "levelset/layers/stack.hpp"

// Transfer of values between one level and the next.
namespace sidewall::levelset {

/// The source of the values of a level's leaves, by column of leaves (8 nodes wide).
enum class LeafColumn : std::uint8_t {
    none,          ///< there are no leaves
    interpolated,  ///< leaves are interpolated from the coarser level
    kept
};

struct LeafColumns {
    std::array<int, 2> count{};
    std::vector<LeafColumn> source;  ///< by column, y fastest

    LeafColumn& at(int x, int y) { return source[static_cast<std::size_t>(x * count[1] + y)]; }
    LeafColumn at(int x, int y) const { return source[static_cast<std::size_t>(x * count[1] + y)]; }
};

/// Interpolates a level's leaves from those of stack.coarser where \p columns say so. Shared nodes take the
/// coarser values; nodes between get cubics through four nodes along each axis, or linear means where those
/// four reach beyond the narrow band. No layer comes to lie above the next one.
/// \note Parallel; O(n) in the leaves made.
void prolongate(MaterialStack& stack, const LeafColumns& columns);

/// Injection: in \p columns of this level, shared nodes of stack.coarser take the values of its narrow band.
/// Elsewhere they keep their own values if these are no smaller than its band's half-width and have its sign
/// (not compared where it has no leaf); else they get that half-width with its sign.
void inject(MaterialStack& stack, const LevelColumns& columns);

}  // namespace sidewall::levelset
