#pragma once
#include <vector>

#include "levelset/layers/stack.hpp"
#include "levelset/motion/motion.hpp"

namespace sidewall::levelset {

/// Share of the largest speed by which a straight line through the speeds of a leaf may rise a coarser cell.
inline constexpr double kSpeedChange = 0.03;

/// Columns in which the speed changes by more than kSpeedChange of the largest one in a coarser cell along the surface, by
/// level but the coarsest; if nothing moves, those that the level has. To be called before the surface moves.
std::vector<LevelColumns> columns_of_speed(const MaterialStack& stack, const Motion& motion);

}  // namespace sidewall::levelset
