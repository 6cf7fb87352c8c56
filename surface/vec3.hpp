#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "surface/infinity.hpp"

namespace sidewall {

/// A point or direction in world space, in the recipe's length unit.
using Vec3 = Eigen::Vector3d;

}  // namespace sidewall
