#include "app/pictures/picture.hpp"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <csetjmp>

#include "app/common/files.hpp"
#include "app/pictures/stroke_font.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

constexpr double kAdvance = 6.0;  // grid units from one character to the next
constexpr double kCapital = 6.0;  // grid units of a capital's height

/// Decodes ASCII and the micro sign; all other characters of UTF-8, which have no glyph, become U+FFFD.
std::u32string characters(std::string_view text) {
    std::u32string result;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const auto byte = static_cast<unsigned char>(text[i]);
        if (byte >> 6 == 2) continue;  // not a character's first byte
        result += byte < 0x80 ? char32_t(byte) : text.substr(i, 2) == "\u00b5" ? U'\u00b5' : U'\ufffd';
    }
    return result;
}

void append_bytes(png_structp png, png_bytep data, png_size_t size) {
    static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<const char*>(data), size);
}

}  // namespace

void draw_stroke(Picture& picture, double x0, double y0, double x1, double y1, double radius,
                 const Colour& colour) {
    const auto low = [&](double a, double b) {
        return static_cast<int>(std::floor(std::min(a, b) - radius - 1.0));
    };
    const auto high = [&](double a, double b) {
        return static_cast<int>(std::ceil(std::max(a, b) + radius + 1.0));
    };
    const double dx = x1 - x0, dy = y1 - y0, square = dx * dx + dy * dy;
    for (int y = std::max(0, low(y0, y1)); y <= std::min(picture.height - 1, high(y0, y1)); ++y)
        for (int x = std::max(0, low(x0, x1)); x <= std::min(picture.width - 1, high(x0, x1)); ++x) {
            const double px = x + 0.5 - x0, py = y + 0.5 - y0;
            const double t = square > 0.0 ? std::clamp((px * dx + py * dy) / square, 0.0, 1.0) : 0.0;
            const double distance = std::hypot(px - t * dx, py - t * dy);
            const double cover = std::clamp(radius + 0.5 - distance, 0.0, 1.0);
            if (cover > 0.0) picture.at(x, y) += cover * (colour - picture.at(x, y));
        }
}

void write_png(const std::filesystem::path& path, const Picture& picture) {
    std::vector<std::uint8_t> row(3 * static_cast<std::size_t>(picture.width));
    std::string bytes;
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png ? png_create_info_struct(png) : nullptr;
    // libpng reports errors by longjmp: make nothing with a destructor between here and the writes.
    if (!info || setjmp(png_jmpbuf(png))) {
        png_destroy_write_struct(&png, &info);
        throw IoError(fmt::format("{}: cannot encode the picture: choose a smaller --size", path.string()));
    }
    png_set_write_fn(png, &bytes, append_bytes, nullptr);
    png_set_IHDR(png, info, static_cast<png_uint_32>(picture.width), static_cast<png_uint_32>(picture.height),
                 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_write_info(png, info);
    for (int y = 0; y < picture.height; ++y) {
        for (int x = 0; x < picture.width; ++x) {
            const auto rgb =
                to_srgb(picture.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) +
                                       static_cast<std::size_t>(x)]);
            std::copy(rgb.begin(), rgb.end(), row.begin() + std::ptrdiff_t{3} * x);
        }
        png_write_row(png, row.data());
    }
    png_write_end(png, nullptr);
    png_destroy_write_struct(&png, &info);
    write_file(path, bytes);
}

double text_width(double size, std::string_view text) {
    const auto count = static_cast<double>(characters(text).size());
    return std::max(0.0, count * kAdvance - 2.0) * size / kCapital;
}

void draw_text(Picture& picture, double x, double y, double size, std::string_view text,
               const Colour& colour) {
    const double unit = size / kCapital;
    for (const char32_t character : characters(text)) {
        const std::string_view strokes = glyph_strokes(character);
        double last_x = 0.0, last_y = 0.0;
        bool fresh = true;
        for (std::size_t i = 0; i + 1 < strokes.size();) {
            if (strokes[i] == ' ') {
                fresh = true;
                ++i;
                continue;
            }
            const double px = x + (strokes[i] - '0') * unit, py = y - (strokes[i + 1] - '2') * unit;
            const bool alone = fresh && (i + 2 >= strokes.size() || strokes[i + 2] == ' ');
            if (!fresh || alone)
                draw_stroke(picture, alone ? px : last_x, alone ? py : last_y, px, py,
                            (alone ? 0.8 : 0.55) * unit, colour);
            last_x = px;
            last_y = py;
            fresh = false;
            i += 2;
        }
        x += kAdvance * unit;
    }
}

void fill_rectangle(Picture& picture, double x, double y, double width, double height, const Colour& colour) {
    const int x0 = std::max(0, static_cast<int>(std::lround(x))),
              y0 = std::max(0, static_cast<int>(std::lround(y)));
    const int x1 = std::min(picture.width, static_cast<int>(std::lround(x + width)));
    const int y1 = std::min(picture.height, static_cast<int>(std::lround(y + height)));
    for (int j = y0; j < y1; ++j)
        for (int i = x0; i < x1; ++i) picture.at(i, j) = colour;
}

}  // namespace sidewall::app
