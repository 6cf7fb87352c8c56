#pragma once
#include <numbers>

namespace sidewall {

/// Share of a full turn about the axis that a slab of \p width covers at \p radius. An axially symmetric
/// wafer is simulated as such a slab: its areas and volumes there are this share of the full ones.
inline double share_of_turn(double width, double radius) {
    return width / (2.0 * std::numbers::pi * radius);
}

}  // namespace sidewall
