#pragma once
#include <functional>
#include <utility>
#include <vector>

#include "levelset/layers/stack.hpp"

namespace sidewall::levelset {

/// Tells a distance at points that lie no farther than \p radius from \p centre, and may leave out what is too far
/// from there to matter.
using DistanceNear = std::function<std::function<double(const Vec3&)>(const Vec3& centre, double radius)>;

/// Whether a grid is wanted in a column of leaves (8 nodes wide), by its number along x and y.
using LeafChoice = std::function<bool(int x, int y)>;

/// sample_grid of \p distance, whose nodes have what \p near makes of it.
/// \param stop   asked often, by any thread; true ends the work
/// \param where  the columns that are made; null: all.
/// \throws Interrupted if \p stop said so.
GridPtr sample_grid(const Domain& domain, const std::function<double(const Vec3&)>& distance,
                    const DistanceNear& near, double z_min, double z_max, const std::function<bool()>& stop,
                    const LeafChoice& where = {});

/// make_stack, which takes time in proportion to cells and layers, ended by \p stop as above.
MaterialStack make_stack(const Domain& domain, const std::vector<std::pair<int, Shape>>& bodies,
                         const std::function<bool()>& stop);

/// The same in part, and before make_distances: bounds of the distances, in which what is thinner than a cell shows as
/// well. A layer may be empty if \p where is given.
MaterialStack sample_stack(const Domain& domain, const std::vector<std::pair<int, Shape>>& bodies,
                           const std::function<bool()>& stop, const LeafChoice& where);

/// Makes distances of a sampled stack. Within two leaves of columns that are missing they are off.
void make_distances(MaterialStack& stack);

}  // namespace sidewall::levelset
