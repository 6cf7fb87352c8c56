#pragma once
#include <algorithm>
#include <array>
#include <limits>

#include "levelset/layers/stack.hpp"

// Features of the wafer that a coarser level does not resolve.
namespace sidewall::levelset {

/// Radii of curvature, in cells of the coarser level: a finer level is needed below kNeeded and given up
/// above kGivenUp.
inline constexpr double kNeeded = 5.0, kGivenUp = 8.0;

/// Number of time steps, of at most half a cell of the finest level each, between choices of the columns.
inline constexpr int kTimeStepsBetweenChoices = 8;

/// The smallest rectangle along x and y that holds some nodes.
struct NodeBox {
    std::array<int, 2> low{std::numeric_limits<int>::max(), std::numeric_limits<int>::max()};
    std::array<int, 2> high{std::numeric_limits<int>::min(), std::numeric_limits<int>::min()};

    void add(int x, int y) {
        low = {std::min(low[0], x), std::min(low[1], y)};
        high = {std::max(high[0], x), std::max(high[1], y)};
    }
    bool empty() const { return low[0] > high[0]; }
};

/// Marks the finer level's columns that features at the coarser level's nodes in \p box may reach until the
/// next choice of columns. Thread-safe.
/// \param coarse  the coarser level's domain.
void mark_columns(const Domain& coarse, const NodeBox& box, LevelColumns& columns);

/// The columns in which \p stack has to count because of the shapes of its layers' fronts, as its coarser
/// level shows them (choose_columns in levelset/layers/levels.hpp).
/// \note Parallel; O(n) in the coarser level's voxels.
LevelColumns columns_of_features(const MaterialStack& stack);

}  // namespace sidewall::levelset
