#pragma once
#include <cstddef>
#include <cstdint>

namespace sidewall::app {

inline constexpr std::size_t kSobolDimensions = 10;

/// Coordinate \p dimension of point \p index of Sobol's sequence in the order of Gray codes (I. A. Antonov and V. M.
/// Saleev, USSR Comput. Math. Math. Phys. 19 (1979) 252), in [0, 1); point 0 is the origin. Of any 2^k
/// points in a row that begin at a multiple of 2^k, one lies in each of 2^k equal parts of every coordinate.
/// Direction numbers: S. Joe and F. Y. Kuo, SIAM J. Sci. Comput. 30 (2008) 2635, their table new-joe-kuo-6.
/// \pre dimension < kSobolDimensions.
double sobol(std::uint32_t index, std::size_t dimension);

}  // namespace sidewall::app
