#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "app/pictures/colour.hpp"

namespace sidewall::app {

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

/// Draws a round-ended line, anti-aliased over one pixel.
void draw_stroke(Picture& picture, double x0, double y0, double x1, double y1, double radius,
                 const Colour& colour);

/// Draws text in strokes, anti-aliased. \p x, \p y: left end of the baseline in pixels; \p size: height of a
/// capital. ASCII and the micro sign; other characters become boxes.
void draw_text(Picture& picture, double x, double y, double size, std::string_view text,
               const Colour& colour);

/// Width in pixels that draw_text() takes.
double text_width(double size, std::string_view text);

/// Fills the pixels of a rectangle, clipped to the picture.
void fill_rectangle(Picture& picture, double x, double y, double width, double height, const Colour& colour);

}  // namespace sidewall::app
