#pragma once
#include <limits>

namespace sidewall {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace sidewall
