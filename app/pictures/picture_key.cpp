#include "app/pictures/picture_key.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace sidewall::app {
namespace {

// Lengths in heights of a capital.
constexpr double kBar = 1.6;        // width of a bar or a swatch
constexpr double kRow = 2.4;        // from one entry to the next
constexpr double kTitle = 1.1;      // height of a title's capitals
constexpr double kMargin = 3.0;     // one before the key, two behind it
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

KeyColumn key_column(const PictureKey& key, int width, int height) {
    if (key.empty()) return {};
    constexpr double kUsual = 0.28;  // of the picture's height
    constexpr double kMost = 0.4;    // of its width
    const double needed = key_width(key) + kMargin;
    double text = std::max(7.0, 0.0165 * height);
    if (!key.bar) text = std::min(text, 0.85 * height / (kRow * static_cast<double>(key.entries.size())));
    KeyColumn column;
    column.width = std::min(std::max(kUsual * height, needed * text), kMost * width);
    column.text = std::min(text, column.width / needed);
    constexpr double kUsualLeft = 10.0;  // so that short keys do not hug the edge
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
