#pragma once
#include <cmath>
#include <initializer_list>
#include <set>
#include <string>
#include <utility>

#include "app/recipe/layout/layout.hpp"
#include "surface/error.hpp"
#include "tests/fuzz/mutate.hpp"

namespace sidewall::fuzz {

/// Whether the layout in \p bytes is read; checks the polygons of \p layers. A refusal must name \p file.
inline bool attempt_layout(const std::string& bytes, const std::string& file,
                           std::initializer_list<std::pair<int, int>> layers) {
    try {
        const app::Layout layout = app::parse_layout(bytes, file);
        std::set<std::string> missing;
        for (const std::string& top : app::top_cells(layout))
            for (const auto& [layer, datatype] : layers)
                for (const levelset::Polygon& polygon : app::flatten(layout, top, layer, datatype, missing)) {
                    expect(polygon.size() >= 3, "a polygon has three corners");
                    for (const auto& [x, y] : polygon)
                        expect(std::isfinite(x) && std::isfinite(y), "corners are finite");
                }
        return true;
    } catch (const FileError& error) {
        expect(std::string(error.what()).starts_with(file + ": "), "an error names the file");
        return false;
    }
}

}  // namespace sidewall::fuzz
