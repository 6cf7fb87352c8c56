#pragma once
#include <functional>
#include <utility>
#include <vector>

#include "levelset/stack.hpp"

namespace sidewall::levelset {

/// Tells a distance at points that lie no farther than \p radius from \p centre, and may leave out what is too far
/// from there to matter.
using DistanceNear = std::function<std::function<double(const Vec3&)>(const Vec3& centre, double radius)>;

/// sample_grid of \p distance, whose nodes have what \p near makes of it.
/// \param stop  asked often, by any thread; true ends the work
/// \throws Interrupted if \p stop said so.
GridPtr sample_grid(const Domain& domain, const std::function<double(const Vec3&)>& distance,
                    const DistanceNear& near, double z_min, double z_max, const std::function<bool()>& stop);

/// make_stack, which takes time in proportion to cells and layers, ended by \p stop as above.
MaterialStack make_stack(const Domain& domain, const std::vector<std::pair<int, Shape>>& bodies,
                         const std::function<bool()>& stop);

}  // namespace sidewall::levelset
