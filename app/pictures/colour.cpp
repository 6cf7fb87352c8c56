#include "app/pictures/colour.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace sidewall::app {
namespace {

double linear(double srgb) {
    return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
}

double gamma(double linear) {
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}

Colour from_code(std::uint32_t code) {
    return {linear(double(code >> 16 & 255) / 255.0), linear(double(code >> 8 & 255) / 255.0),
            linear(double(code & 255) / 255.0)};
}

constexpr std::uint32_t kGrey = 0xb4b8be;

}  // namespace

Colour colour_from_hex(std::string_view hex) {
    std::uint32_t code = 0;
    if (hex.size() != 7 || hex[0] != '#') return from_code(kGrey);
    const auto [end, failure] = std::from_chars(hex.data() + 1, hex.data() + 7, code, 16);
    return from_code(failure == std::errc{} && end == hex.data() + 7 ? code : kGrey);
}

std::array<std::uint8_t, 3> to_srgb(const Colour& colour) {
    std::array<std::uint8_t, 3> result{};
    for (int k = 0; k < 3; ++k)
        result[static_cast<std::size_t>(k)] =
            static_cast<std::uint8_t>(std::lround(255.0 * gamma(std::clamp(colour[k], 0.0, 1.0))));
    return result;
}

Colour viridis(double value) {
    constexpr std::uint32_t kAnchors[] = {0x440154, 0x482475, 0x414487, 0x355f8d, 0x2a788e, 0x21918c,
                                          0x22a884, 0x44bf70, 0x7ad151, 0xbddf26, 0xfde725};
    constexpr int kLast = static_cast<int>(std::size(kAnchors)) - 1;
    if (!std::isfinite(value)) return from_code(kGrey);
    const double at = std::clamp(value, 0.0, 1.0) * kLast;
    const int i = std::min(kLast - 1, static_cast<int>(at));
    const double weight = at - i;
    return (1.0 - weight) * from_code(kAnchors[i]) + weight * from_code(kAnchors[i + 1]);
}

Ticks round_ticks(double low, double high, int wanted) {
    const double span = high - low;
    if (!(span > 0.0) || !std::isfinite(span)) return {low, 1.0, std::isfinite(low) ? 1 : 0};
    const double rough = span / std::max(1, wanted), decade = std::pow(10.0, std::floor(std::log10(rough)));
    double step = 10.0 * decade;
    for (const double factor : {5.0, 2.5, 2.0, 1.0})
        if (factor * decade >= rough * (1.0 - 1e-9)) step = factor * decade;
    // Whole multiples of the step: rounding neither loses nor adds a tick at an end.
    const double first = std::ceil(low / step - 1e-9), last = std::floor(high / step + 1e-9);
    return {first * step, step, static_cast<int>(last - first) + 1};
}

}  // namespace sidewall::app
