#include "app/recipe/layout/layout.hpp"

#include <fmt/format.h>

#include <set>

#include "surface/error.hpp"

namespace sidewall::app {
namespace {

constexpr std::size_t kMostCorners = 50'000'000;

void keep(Layout& layout, LayoutCell& cell, LayoutShape shape) {
    if ((layout.corners += shape.polygon.size()) > kMostCorners)
        throw FileError(fmt::format("{}: its cells hold over {} corners of polygons; export less of the chip",
                                    layout.file, kMostCorners));
    cell.shapes.push_back(std::move(shape));
}

}  // namespace

std::array<double, 2> Repetition::offset(std::uint64_t k) const {
    if (!places.empty()) return places[k];
    const std::uint64_t whole = k / columns;
    const auto column = static_cast<double>(k % columns), row = static_cast<double>(whole);
    return {column * column_step[0] + row * row_step[0], column * column_step[1] + row * row_step[1]};
}

void add_polygon(Layout& layout, LayoutCell& cell, LayoutShape shape) {
    shape.polygon = levelset::distinct(std::move(shape.polygon));
    if (shape.polygon.size() >= 3) keep(layout, cell, std::move(shape));
}

void add_path(Layout& layout, LayoutCell& cell, const LayoutShape& centre_line,
              const levelset::PathStyle& style) {
    if (const levelset::Polygon& ends = centre_line.polygon; ends.size() == 2 && style.half_width == 0.0) {
        LayoutShape line = centre_line;
        line.polygon = {ends[0], ends[0], ends[1], ends[1]};
        keep(layout, cell, std::move(line));
    }
    for (levelset::Polygon& polygon : levelset::path_polygons(centre_line.polygon, style))
        add_polygon(layout, cell,
                    {centre_line.layer, centre_line.datatype, std::move(polygon), centre_line.repetition});
}

void add_cell(Layout& layout, const std::string& name, LayoutCell cell) {
    if (name == "$$$CONTEXT_INFO$$$") return;
    if (!layout.cells.emplace(name, std::move(cell)).second)
        throw FileError(fmt::format("{}: cell {} is defined twice; export it again", layout.file, name));
}

std::vector<std::string> top_cells(const Layout& layout) {
    std::set<std::string> placed;
    for (const auto& [name, cell] : layout.cells)
        for (const CellReference& reference : cell.references) placed.insert(reference.cell);
    std::vector<std::string> tops;
    for (const auto& [name, cell] : layout.cells)
        if (!placed.contains(name)) tops.push_back(name);
    return tops;
}

}  // namespace sidewall::app
