#pragma once
#include <array>

#include "surface/vec3.hpp"

namespace sidewall::app {

/// Speeds of crystal faces of the families <100>, <110>, <111> and <311>.
struct CrystalRates {
    double r100 = 0.0, r110 = 0.0, r111 = 0.0, r311 = 0.0;
};

/// Unit vectors of the crystal's three <100> axes, orthogonal.
using CrystalAxes = std::array<Vec3, 3>;

/// Speed of a face of any normal: exact for the four families, between them linear in the sorted direction
/// cosines (Hubbard; Radjenovic et al., Sensors 10, 4950 (2010)). \p normal need not have unit length.
double crystal_rate(const Vec3& normal, const CrystalAxes& axes, const CrystalRates& rates);

/// Bounds of |dH/dp| along the grid's axes over all directions p, where H = |p| V(p/|p|).
struct CrystalBound {
    Vec3 by_axis = Vec3::Zero();  ///< largest value along each axis
    double sum = 0.0;             ///< largest sum over the axes
};
CrystalBound crystal_bound(const CrystalAxes& axes, const CrystalRates& rates);

/// Crystal axes from two of them, which need not have unit length and are made orthogonal.
/// \returns zero vectors if they are parallel.
CrystalAxes crystal_axes(const Vec3& first, const Vec3& second);

}  // namespace sidewall::app
