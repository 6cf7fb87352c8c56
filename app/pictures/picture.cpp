#include "app/pictures/picture.hpp"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <csetjmp>

#include "app/common/files.hpp"
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

struct Glyph {
    char32_t character;
    std::string_view strokes;
};

constexpr Glyph kGlyphs[] = {
    {U' ', ""},
    {U'0', "120307183847433212"},
    {U'1', "072822 1232"},
    {U'2', "07183847460242"},
    {U'3', "071838474635 1535444332 321203"},
    {U'4', "32380444"},
    {U'5', "480805354443321203"},
    {U'6', "4738180703123243443505"},
    {U'7', "084812"},
    {U'8', "15060718384746351504031232434435"},
    {U'9', "0312324347381807061545"},
    {U'.', "22"},
    {U',', "2211"},
    {U'-', "1535"},
    {U'+', "0545 2327"},
    {U'/', "0148"},
    {U'(', "38272332"},
    {U')', "18272312"},
    {U'[', "38282232"},
    {U']', "18383212"},
    {U'_', "0141"},
    {U':', "23 26"},
    {U'=', "0444 0646"},
    {U'^', "162836"},
    {U'%', "0248 07 43"},
    {U'*', "0347 0743 2228"},
    {U'<', "470543"},
    {U'>', "074503"},
    {U'|', "2129"},
    {U'A', "022842 1434"},
    {U'B', "02083847463505 3544433202"},
    {U'C', "4738180703123243"},
    {U'D', "02083847433202"},
    {U'E', "48080242 0535"},
    {U'F', "480802 0535"},
    {U'G', "47381807031232434525"},
    {U'H', "0208 4248 0545"},
    {U'I', "1838 2228 1232"},
    {U'J', "4843321203"},
    {U'K', "0208 480542"},
    {U'L', "080242"},
    {U'M', "0208254842"},
    {U'N', "02084248"},
    {U'O', "120307183847433212"},
    {U'P', "02083847463505"},
    {U'Q', "120307183847433212 2441"},
    {U'R', "02083847463505 2542"},
    {U'S', "473818070615354443321203"},
    {U'T', "0848 2228"},
    {U'U', "080312324348"},
    {U'V', "082248"},
    {U'W', "0812253248"},
    {U'X', "0248 0842"},
    {U'Y', "082548 2522"},
    {U'Z', "08480242"},
    {U'a', "4246 4536160503123243"},
    {U'b', "0208 0516364543321203"},
    {U'c', "4536160503123243"},
    {U'd', "4248 4536160503123243"},
    {U'e', "04444536160503123243"},
    {U'f', "48382722 1646"},
    {U'g', "4641301001 4536160503123243"},
    {U'h', "0208 0516364542"},
    {U'i', "2622 28"},
    {U'j', "36312010 38"},
    {U'k', "0208 460442"},
    {U'l', "2822"},
    {U'm', "0602 05162522 25364542"},
    {U'n', "0602 0516364542"},
    {U'o', "120305163645433212"},
    {U'p', "0600 0516364543321203"},
    {U'q', "4640 4536160503123243"},
    {U'r', "0602 05163645"},
    {U's', "45361605143443321203"},
    {U't', "28233242 1646"},
    {U'u', "0603123243 4642"},
    {U'v', "062246"},
    {U'w', "0612243246"},
    {U'x', "0246 0642"},
    {U'y', "0622 4610"},
    {U'z', "06460242"},
    {U'\u00b5', "0006 03123243 4642"},
};

// The strokes of a character: points "xy" on a grid of x 0..4 and y 0..8, joined to lines; a space begins a
// new line, a point alone is a dot. Capitals stand from y = 2 to 8, small letters reach 6, descenders 0.
std::string_view glyph_strokes(char32_t character) {
    for (const Glyph& glyph : kGlyphs)
        if (glyph.character == character) return glyph.strokes;
    return "0208484202";
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
