#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

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

/// A picture: pixels row by row from the top left, in linear light.
struct Picture {
    int width = 0, height = 0;
    std::vector<Colour> pixels;

    Picture(int w, int h)
        : width(w), height(h), pixels(static_cast<std::size_t>(w) * static_cast<std::size_t>(h)) {}
    Colour& at(int x, int y) { return pixels[index(x, y)]; }
    const Colour& at(int x, int y) const { return pixels[index(x, y)]; }

  private:
    std::size_t index(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
    }
};

/// Writes eight-bit sRGB PNG; the same picture gives the same bytes.
/// \throws IoError.
void write_png(const std::filesystem::path& path, const Picture& picture);

/// Draws text in strokes, anti-aliased. \p x, \p y: left end of the baseline in pixels; \p size: height of a
/// capital. ASCII and the micro sign; other characters become boxes.
void draw_text(Picture& picture, double x, double y, double size, std::string_view text,
               const Colour& colour);

/// Fills the pixels of a rectangle, clipped to the picture.
void fill_rectangle(Picture& picture, double x, double y, double width, double height, const Colour& colour);

/// An entry of the key: a swatch with a name.
struct LegendEntry {
    std::string name;
    Colour colour;
};

/// The key to a picture's colours: a viridis bar of values, or swatches with names.
struct PictureKey {
    bool bar = false;
    std::string title;  ///< quantity of the bar with its unit
    double low = 0.0, high = 1.0;
    std::vector<LegendEntry> entries;  ///< where there is no bar

    bool empty() const { return !bar && entries.empty(); }
};

/// The column at a picture's right that holds the key; lengths in pixels.
struct KeyColumn {
    double width = 0.0;  ///< column width, to the picture's right edge; 0 without a key
    double left = 0.0;   ///< x of the key's left end
    double text = 0.0;   ///< height of a capital
};

/// The column for \p key: at most two fifths of the picture's width; the text shrinks to fit.
KeyColumn key_column(const PictureKey& key, int width, int height);

/// Draws \p key into its column: the bar with round ticks and its title above, or the entries one below the
/// other.
void draw_key(Picture& picture, const PictureKey& key, const KeyColumn& column);

}  // namespace sidewall::app
