#pragma once
#include <functional>
#include <utility>
#include <vector>

#include "levelset/grid.hpp"
#include "levelset/layers/stack.hpp"
#include "levelset/shapes/shapes.hpp"

namespace sidewall::levelset {

/// The stack of the given bodies, bottom up, each united with all below.
/// \param stop  polled as by sample_grid: the work grows with cells times layers.
/// \throws GeometryError for a shape that makes no surface in the domain, FileError for a mesh file that
///         cannot be read, Interrupted if \p stop said so.
MaterialStack make_stack(const Domain& domain, const std::vector<std::pair<int, Shape>>& bodies,
                         const std::function<bool()>& stop = {});

/// A stack in some columns only, whose values are bounds of the distances (make_distances comes after). In them
/// layers thinner than a cell show as well. A layer may be empty if \p where is given.
MaterialStack sample_stack(const Domain& domain, const std::vector<std::pair<int, Shape>>& bodies,
                           const std::function<bool()>& stop, const LeafChoice& where);

/// Turns the bounds of a sampled stack into distances. Within two leaves of missing columns these are off.
void make_distances(MaterialStack& stack);

}  // namespace sidewall::levelset
