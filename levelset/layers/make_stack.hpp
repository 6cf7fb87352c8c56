#pragma once
#include <functional>
#include <utility>
#include <vector>

#include "levelset/grid.hpp"
#include "levelset/layers/stack.hpp"
#include "levelset/shapes/shapes.hpp"

namespace sidewall::levelset {

/// The stack of the given bodies (material and shape), bottom up, each united with all below.
/// \param stop  polled as by sample_grid: the work grows with cells times layers.
/// \throws GeometryError for a shape that makes no surface in the domain, FileError for a mesh file that
///         cannot be read, Interrupted if \p stop said so.
MaterialStack make_stack(const Domain& domain, const std::vector<std::pair<int, Shape>>& bodies,
                         const std::function<bool()>& stop = {});

/// Samples a stack in the columns of \p where (null: all). Its values are bounds of the distances, in which
/// layers thinner than a cell show, too; make_distances comes after. With \p where a layer may be empty.
MaterialStack sample_stack(const Domain& domain, const std::vector<std::pair<int, Shape>>& bodies,
                           const std::function<bool()>& stop, const LeafChoice& where);

/// Turns the bounds of a sampled stack into distances. Within two leaves of missing columns these are off.
void make_distances(MaterialStack& stack);

}  // namespace sidewall::levelset
