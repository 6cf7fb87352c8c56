#pragma once
#include "levelset/layers/stack.hpp"

// Where a coarser level does not do.
namespace sidewall::levelset {

/// Radii of curvature, in cells of the coarser level, below which it does not do and above which it does again.
inline constexpr double kCoarseCells = 5.0, kGivenUp = 8.0;

/// Share of the largest speed by which a straight line through the speeds of a leaf may rise a coarser cell.
inline constexpr double kSpeedChange = 0.03;

/// The columns of \p stack, which has a coarser level, that it is to count in for the shapes of all layers' fronts: see
/// choose_columns in levelset/layers/levels.hpp.
/// \note Parallel; O(n) in the coarser level's voxels.
LevelColumns columns_of_features(const MaterialStack& stack);

}  // namespace sidewall::levelset
