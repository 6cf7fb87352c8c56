#pragma once
#include <array>
#include <cstdint>
#include <string_view>

#include "surface/vec3.hpp"

namespace sidewall::app {

/// A colour in linear light, red, green, blue in [0, 1].
using Colour = Vec3;

/// From sRGB as written in style sheets, "#rrggbb"; grey if the text is anything else.
Colour colour_from_hex(std::string_view hex);

/// Eight-bit sRGB, clamped.
std::array<std::uint8_t, 3> to_srgb(const Colour& colour);

/// Perceptually uniform map of [0, 1], clamped; grey where not finite. The viridis map of van der Walt and
/// Smith, 2015.
Colour viridis(double value);

/// Values at which a colour bar is labelled: round numbers within [low, high], about \p wanted of them.
struct Ticks {
    double first = 0.0, step = 1.0;
    int count = 0;
};
Ticks round_ticks(double low, double high, int wanted);

}  // namespace sidewall::app
