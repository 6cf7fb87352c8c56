#include "app/pictures/film_strip.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/common/files.hpp"
#include "app/common/text.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

/// Time of a surface, such as "48 s"; empty if its mesh has none.
std::string time_text(const Result& result) {
    const std::optional<double> time = metadata_number(result.metadata, "time");
    return time ? fmt::format("{:.6g} {}", *time, metadata_text(result.metadata, "time_unit", "")) : "";
}

/// The scale that all pictures share. Sets options.color to the attribute's full name, so that `flux` means
/// the same species' flux in every picture.
PictureScale common_scale(const fs::path& run, const std::vector<SavedSurface>& saved,
                          RenderOptions& options) {
    PictureScale common;
    bool found = false;
    for (const SavedSurface& one : saved) {
        const Result result = read_saved(run, one);
        common.extend(result);
        // Surfaces of steps without fluxes lack the attribute; it is an error only if all do.
        const bool last = &one == &saved.back();
        auto own = last && !found ? choose_colouring(result, options.color, options.range)
                                  : find_colouring(result, options.color, options.range);
        if (!own) continue;
        if (found) {
            own->low = std::min(own->low, common.colouring.low);
            own->high = std::max(own->high, common.colouring.high);
        }
        found = true;
        own->values.clear();
        common.colouring = *std::move(own);
        if (common.colouring.scalar) options.color = common.colouring.attribute;
    }
    return common;
}

// File that lists the pictures, one name per line.
constexpr const char* kList = "pictures.txt";

/// Removes pictures of an earlier call that this one does not replace, and lists those that it writes.
void begin_pictures(const fs::path& folder, const std::vector<std::string>& names) {
    std::error_code failure;
    if (fs::exists(folder / kList, failure))
        for (const std::string& name : split(surface::read_whole_file(folder / kList), '\n')) {
            const fs::path file(name);
            if (file.filename() == file && file.extension() == ".png" &&
                std::find(names.begin(), names.end(), name) == names.end())
                fs::remove(folder / file, failure);
        }
    std::string text;
    for (const std::string& name : names) text += name + "\n";
    write_file(folder / kList, text);
}

/// Shrinks the left \p width pixels to means over \p factor x \p factor pixels, without incomplete squares.
Picture shrunk(const Picture& picture, int width, int factor) {
    Picture small(width / factor, picture.height / factor);
    for (int y = 0; y < small.height; ++y)
        for (int x = 0; x < small.width; ++x) {
            Colour sum = Colour::Zero();
            for (int j = 0; j < factor; ++j)
                for (int i = 0; i < factor; ++i) sum += picture.at(x * factor + i, y * factor + j);
            small.at(x, y) = sum / (factor * factor);
        }
    return small;
}

/// Factor by which pictures of \p width x \p height pixels shrink for strip.png.
int strip_factor(int width, int height, std::size_t count) {
    constexpr double kUsual = 300.0;  // pixels of width that a picture keeps
    constexpr double kMost = 4e6;     // pixels in all
    const double all = static_cast<double>(width) * height * static_cast<double>(count);
    const double factor = std::max(std::round(width / kUsual), std::ceil(std::sqrt(all / kMost)));
    return std::clamp(static_cast<int>(factor), 1, std::min(width, height));
}

/// Joins pictures of one size, row by row, to about a screen's aspect ratio, with the key at the right.
Picture strip_picture(const std::vector<Picture>& cells, const PictureKey& key) {
    const int width = cells.front().width, height = cells.front().height;
    const auto count = static_cast<double>(cells.size());
    const auto rows_of = [](int n, int in_row) { return (n + in_row - 1) / in_row; };
    const int number = static_cast<int>(cells.size());
    const int widest =
        static_cast<int>(std::clamp(std::round(std::sqrt(16.0 / 9.0 * count * height / width)), 1.0, count));
    const int rows = rows_of(number, widest),
              columns = rows_of(number, rows);  // fills the last row as far as possible
    // The key has the size that it has on a page of whose width the cells take three fifths.
    const int page = columns * width * 5 / 3;
    KeyColumn column = key_column(key, page, rows * height);
    Picture strip(columns * width + static_cast<int>(std::ceil(column.width)), rows * height);
    fill_rectangle(strip, 0.0, 0.0, strip.width, strip.height, colour_from_hex("#ffffff"));
    for (std::size_t n = 0; n < cells.size(); ++n) {
        const int left = static_cast<int>(n) % columns * width, top = static_cast<int>(n) / columns * height;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) strip.at(left + x, top + y) = cells[n].at(x, y);
    }
    column.left += strip.width - page;
    if (!key.empty()) draw_key(strip, key, column);
    return strip;
}

}  // namespace

std::string name_and_time(const Result& result) {
    const std::string time = time_text(result);
    return result.source.filename().string() + (time.empty() ? "" : ", time " + time);
}

void render_all(const fs::path& run, const RenderOptions& options, const fs::path& output,
                const std::function<void(const std::string&)>& done) {
    const std::vector<SavedSurface> saved = saved_surfaces(run);
    RenderOptions own = options;
    const PictureScale scale = common_scale(run, saved, own);
    const PictureKey key = key_of(scale);
    const int width = own.width - static_cast<int>(std::ceil(key_column(key, own.width, own.height).width));
    const int factor = strip_factor(width, own.height, saved.size());
    std::vector<std::string> names;
    names.reserve(saved.size() + 1);
    for (const SavedSurface& one : saved)
        names.push_back(one.file.filename().replace_extension(".png").string());
    names.emplace_back("strip.png");
    begin_pictures(output, names);
    std::vector<Picture> cells;
    for (const SavedSurface& one : saved) {
        const Result result = read_saved(run, one);
        const Picture picture = render(result, own, scale);
        const auto file = output / one.file.filename().replace_extension(".png");
        write_png(file, picture);
        cells.push_back(shrunk(picture, width, factor));
        const double text = std::max(6.0, 0.045 * cells.back().height);
        draw_text(cells.back(), text, 2.0 * text, text, time_text(result), colour_from_hex("#2b303a"));
        done(
            fmt::format("{}: {}{}", file.string(), name_and_time(result),
                        find_colouring(result, own.color, {}) ? "" : fmt::format(", without {}", own.color)));
    }
    write_png(output / "strip.png", strip_picture(cells, key));
    done(fmt::format("{}: all {}", (output / "strip.png").string(), saved.size()));
}

}  // namespace sidewall::app
