#pragma once
#include <numbers>

namespace sidewall {

/// The share of a full turn about an axis that a strip of \p width makes at \p radius. A round wafer is held as such a
/// strip: what lies at the radius is as much of its revolution.
inline double share_of_turn(double width, double radius) {
    return width / (2.0 * std::numbers::pi * radius);
}

}  // namespace sidewall
