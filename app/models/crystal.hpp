#pragma once
#include <array>

#include "surface/vec3.hpp"

namespace sidewall::app {

/// Speeds of a crystal's faces of the families <100>, <110>, <111> and <311>.
struct CrystalRates {
    double r100 = 0.0, r110 = 0.0, r111 = 0.0, r311 = 0.0;
};

/// Unit vectors of the crystal's three <100> axes, orthogonal.
using CrystalAxes = std::array<Vec3, 3>;

/// Speed of a face of any normal: exact on the four families, linear in the normal's sorted direction cosines
/// between them (Hubbard; Radjenovic et al., Sensors 10, 4950 (2010)). \p normal need not have unit length.
double crystal_rate(const Vec3& normal, const CrystalAxes& axes, const CrystalRates& rates);

/// Largest |dH/dp| along the axes of the grid over all directions p, H = |p| V(p/|p|).
struct CrystalBound {
    Vec3 by_axis = Vec3::Zero();  ///< the largest along each
    double sum = 0.0;             ///< the largest sum over them
};
CrystalBound crystal_bound(const CrystalAxes& axes, const CrystalRates& rates);

/// Axes from two of them, which need be neither of unit length nor quite orthogonal.
/// \returns zero vectors if they are parallel.
CrystalAxes crystal_axes(const Vec3& first, const Vec3& second);

}  // namespace sidewall::app
