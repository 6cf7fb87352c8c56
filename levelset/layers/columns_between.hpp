#pragma once
#include <array>
#include <vector>

#include "levelset/domain.hpp"

namespace sidewall::levelset {

/// Calls use(x, y) with the columns of 2^\p shift nodes a side (LevelColumns) that hold the domain's nodes from \p low to
/// \p high along x and y, or the own nodes that those beyond its sides repeat. A column may come twice.
template <class Use>
void each_column_between(const Domain& domain, std::array<int, 2> low, std::array<int, 2> high, int shift,
                         Use&& use) {
    std::array<std::vector<int>, 2> columns;
    for (int axis = 0; axis < 2; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        for (int node = low[a]; node <= high[a]; ++node)  // all: beyond a side columns may begin anywhere
            if (const int column = domain.source_node(axis, node) >> shift;
                columns[a].empty() || columns[a].back() != column)
                columns[a].push_back(column);
    }
    for (const int x : columns[0])
        for (const int y : columns[1]) use(x, y);
}

}  // namespace sidewall::levelset
