#pragma once
#include <array>
#include <cstdint>
#include <string_view>

#include "surface/vec3.hpp"

namespace sidewall::app {

/// A colour in linear light, red, green, blue in [0, 1].
using Colour = Vec3;

/// The colour of an sRGB text "#rrggbb"; grey for any other text.
Colour colour_from_hex(std::string_view hex);

/// Converts to eight-bit sRGB, clamped.
std::array<std::uint8_t, 3> to_srgb(const Colour& colour);

/// The viridis map of van der Walt and Smith (2015) on [0, 1], clamped; grey where not finite.
Colour viridis(double value);

/// Values at which a colour bar is labelled: round numbers within [low, high], about \p wanted of them.
struct Ticks {
    double first = 0.0, step = 1.0;
    int count = 0;
};
Ticks round_ticks(double low, double high, int wanted);

}  // namespace sidewall::app
