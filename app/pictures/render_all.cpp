#include "app/pictures/render_all.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace sidewall::app {
namespace {

/// The scale that all pictures share. \p options get the attribute's full name, so that `flux` is the same species'
/// flux in every picture.
PictureScale common_scale(const fs::path& run, const std::vector<SavedSurface>& saved,
                          RenderOptions& options) {
    PictureScale common;
    bool found = false;
    for (const SavedSurface& one : saved) {
        const Result result = read_saved(run, one);
        common.extend(result);
        // Surfaces of a step without fluxes lack them; it is an error only where all do.
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

}  // namespace

std::string name_and_time(const Result& result) {
    const std::string name = result.source.filename().string();
    const std::optional<double> time = metadata_number(result.metadata, "time");
    return time ? fmt::format("{}, time {:.6g} {}", name, *time,
                              metadata_text(result.metadata, "time_unit", ""))
                : name;
}

void render_all(const fs::path& run, const RenderOptions& options, const fs::path& output,
                const std::function<void(const std::string&)>& done) {
    const std::vector<SavedSurface> saved = saved_surfaces(run);
    RenderOptions own = options;
    const PictureScale scale = common_scale(run, saved, own);
    for (const SavedSurface& one : saved) {
        const Result result = read_saved(run, one);
        const auto file = output / one.file.filename().replace_extension(".png");
        write_png(file, render(result, own, scale));
        done(
            fmt::format("{}: {}{}", file.string(), name_and_time(result),
                        find_colouring(result, own.color, {}) ? "" : fmt::format(", without {}", own.color)));
    }
}

}  // namespace sidewall::app
