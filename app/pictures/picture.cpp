#include "app/pictures/picture.hpp"

#include <fmt/format.h>

#include <png.h>
#include <algorithm>
#include <cmath>

#include "app/common/files.hpp"
#include "surface/files/file.hpp"

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

// The strokes of a character: points "xy" on a grid of x 0..4 and y 0..8, joined to lines; a space begins a
// new line, a point alone is a dot. Capitals stand from y = 2 to 8, small letters reach 6, descenders 0.
std::string_view glyph_strokes(char32_t character) {
    for (const Glyph& glyph : kGlyphs)
        if (glyph.character == character) return glyph.strokes;
    return "0208484202";
}

// Lengths in heights of a capital.
constexpr double kBar = 1.6;        // width of a bar or a swatch
constexpr double kRow = 2.4;        // from one entry to the next
constexpr double kTitle = 1.1;      // height of a title's capitals
constexpr double kMargin = 3.0;     // 1 before the key, 2 after it
constexpr double kTickLabel = 1.0;  // from a bar to its labels
constexpr double kName = 0.9;       // from a swatch to its name

std::string number_text(double value, double step) {
    if (std::abs(value) < 1e-9 * step) return "0";
    const double size = std::max(std::abs(value), step);
    if (size >= 1e5 || size < 1e-3) return fmt::format("{:.3g}", value);
    int digits = 0;
    for (double rest = step; digits < 6 && std::abs(rest - std::round(rest)) > 1e-6 * rest; rest *= 10.0)
        ++digits;
    return fmt::format("{:.{}f}", value, digits);
}

// Draws a round-ended line, anti-aliased over one pixel.
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

// Width in pixels that draw_text() takes.
double text_width(double size, std::string_view text) {
    const auto count = static_cast<double>(characters(text).size());
    return std::max(0.0, count * kAdvance - 2.0) * size / kCapital;
}

/// Width of a key, in heights of a capital.
double key_width(const PictureKey& key) {
    double width = 0.0;
    if (!key.bar) {
        for (const LegendEntry& entry : key.entries)
            width = std::max(width, kBar + kName + text_width(1.0, entry.name));
        return width;
    }
    const Ticks ticks = round_ticks(key.low, key.high, 5);
    for (int i = 0; i < ticks.count; ++i)
        width = std::max(width, kBar + kTickLabel +
                                    text_width(1.0, number_text(ticks.first + i * ticks.step, ticks.step)));
    return std::max(width, text_width(kTitle, key.title));
}

void draw_colour_bar(Picture& picture, const PictureKey& key, double x, double y, double height,
                     double text) {
    const Colour ink = colour_from_hex("#2b303a");
    const double width = kBar * text;
    fill_rectangle(picture, x - 1.0, y - 1.0, width + 2.0, height + 2.0, ink);
    const int rows = static_cast<int>(std::lround(height));
    for (int row = 0; row < rows; ++row)
        fill_rectangle(picture, x, y + row, width, 1.0, viridis(1.0 - (row + 0.5) / rows));
    const Ticks ticks = round_ticks(key.low, key.high, 5);
    for (int i = 0; i < ticks.count; ++i) {
        const double value = ticks.first + i * ticks.step;
        const double at = key.high > key.low ? y + height * (1.0 - (value - key.low) / (key.high - key.low))
                                             : y + 0.5 * height;
        draw_stroke(picture, x + width, at, x + width + 0.5 * text, at, 0.06 * text, ink);
        draw_text(picture, x + width + kTickLabel * text, at + 0.5 * text, text,
                  number_text(value, ticks.step), ink);
    }
    draw_text(picture, x, y - 1.5 * text, kTitle * text, key.title, ink);
}

void draw_legend(Picture& picture, const std::vector<LegendEntry>& entries, double x, double y, double text) {
    const Colour ink = colour_from_hex("#2b303a");
    for (std::size_t i = 0; i < entries.size(); ++i) {
        const double top = y + kRow * text * static_cast<double>(i), side = kBar * text;
        fill_rectangle(picture, x - 1.0, top - 1.0, side + 2.0, side + 2.0, ink);
        fill_rectangle(picture, x, top, side, side, entries[i].colour);
        draw_text(picture, x + side + kName * text, top + 0.5 * (side + text), text, entries[i].name, ink);
    }
}

}  // namespace

void write_png(const fs::path& path, const Picture& picture) {
    std::vector<std::uint8_t> rgb;
    rgb.reserve(3 * picture.pixels.size());
    for (const Colour& pixel : picture.pixels) {
        const auto bytes = to_srgb(pixel);
        rgb.insert(rgb.end(), bytes.begin(), bytes.end());
    }
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = static_cast<png_uint_32>(picture.width);
    image.height = static_cast<png_uint_32>(picture.height);
    image.format = PNG_FORMAT_RGB;
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
    std::string file(size, '\0');
    if (png_image_write_to_memory(&image, file.data(), &size, 0, rgb.data(), 0, nullptr) == 0)
        throw IoError("{}: cannot encode the picture: choose a smaller --size", path.string());
    file.resize(size);
    write_file(path, file);
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

Colour colour_from_hex(std::string_view hex) {
    std::uint32_t code = 0;
    const bool good = hex.size() == 7 && hex[0] == '#' && surface::read_number(hex.substr(1), code, 16);
    return from_code(good ? code : kGrey);
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
    // Ticks are whole multiples of the step; the tolerance keeps rounding from losing one at an end.
    const double first = std::ceil(low / step - 1e-9), last = std::floor(high / step + 1e-9);
    return {first * step, step, static_cast<int>(last - first) + 1};
}

KeyColumn key_column(const PictureKey& key, int width, int height) {
    if (key.empty()) return {};
    constexpr double kUsual = 0.28;  // share of the picture's height
    constexpr double kMost = 0.4;    // share of its width
    const double needed = key_width(key) + kMargin;
    double text = std::max(7.0, 0.0165 * height);
    if (!key.bar) text = std::min(text, 0.85 * height / (kRow * static_cast<double>(key.entries.size())));
    KeyColumn column;
    column.width = std::min(std::max(kUsual * height, needed * text), kMost * width);
    column.text = std::min(text, column.width / needed);
    constexpr double kUsualLeft = 10.0;  // so that short keys keep clear of the edge
    column.left = std::max(width - column.width + column.text,
                           width - std::max(kUsualLeft, needed - 1.0) * column.text);
    return column;
}

void draw_key(Picture& picture, const PictureKey& key, const KeyColumn& column) {
    if (key.bar)
        draw_colour_bar(picture, key, column.left, std::max(0.12 * picture.height, 3.0 * column.text),
                        0.45 * picture.height, column.text);
    else
        draw_legend(picture, key.entries, column.left, 0.1 * picture.height, column.text);
}

}  // namespace sidewall::app
