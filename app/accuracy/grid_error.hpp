#pragma once
#include <string>
#include <vector>

namespace sidewall::app {

/// A figure on one grid.
struct GridValue {
    double spacing = 0.0;
    double value = 0.0;  ///< not finite where the grid does not have it
    double noise = 0.0;  ///< 95 % bar of the random numbers alone
};

/// Bound of the difference between the figure on the finest grid and on an infinitely fine one.
struct GridError {
    double bar = 0.0;    ///< infinite if it is unknown
    std::string reason;  ///< why it is not known, or why it is no better than it is; empty: differences fall
                         ///< as they should
    bool falling() const { return reason.empty(); }
};

/// Roache's grid convergence index (P. J. Roache, J. Fluids Eng. 116 (1994) 405) of order 1 or less: from the last three
/// grids the error on the finest is |f2 - f1| / (r^p - 1) with r the ratio of spacings, p the order seen, at most 1, times a
/// safety factor of 1.25; no less than what the next coarser pair leaves at order 2, so that two values that agree by chance claim
/// nothing; of values that go up and down, whose last two enclose the limit, their difference. The factor is 3 where
/// there are two grids, or differences do not fall.
///
/// \param grids  coarsest first, spacings falling; those before a grid that does not have the figure do not count.
/// \param least  no smaller bar is given where there is any.
GridError grid_error(const std::vector<GridValue>& grids, double least);

}  // namespace sidewall::app
