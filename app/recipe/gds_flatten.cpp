#include "app/recipe/gds_flatten.hpp"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <set>

#include "surface/error.hpp"

namespace sidewall::app {
namespace {

constexpr double kMostPlacements = 1e7, kMostPolygons = 2e6, kMostFlatCorners = 2e7;
constexpr double kFarthest = 1e3;  // metres

// x -> m x + o
struct Placement {
    double m[2][2] = {{1.0, 0.0}, {0.0, 1.0}};
    std::array<double, 2> o{0.0, 0.0};

    std::array<double, 2> apply(const std::array<double, 2>& p) const {
        return {m[0][0] * p[0] + m[0][1] * p[1] + o[0], m[1][0] * p[0] + m[1][1] * p[1] + o[1]};
    }
    Placement of(const GdsReference& r, int column, int row) const {
        const double c = r.magnification * std::cos(r.angle), s = r.magnification * std::sin(r.angle),
                     flip = r.mirror ? -1.0 : 1.0;
        const double local[2][2] = {{c, -flip * s}, {s, flip * c}};
        Placement result;
        for (int i = 0; i < 2; ++i)
            for (int j = 0; j < 2; ++j) result.m[i][j] = m[i][0] * local[0][j] + m[i][1] * local[1][j];
        result.o = apply({r.origin[0] + column * r.column_step[0] + row * r.row_step[0],
                          r.origin[1] + column * r.column_step[1] + row * r.row_step[1]});
        return result;
    }
};

// What a cell becomes with all it refers to. Numbers of a hostile file leave the range of integers.
struct Expansion {
    double placements = 1.0, polygons = 0.0, corners = 0.0;
};

// A cell on the way down from the top one, and the reference that is next: loops, so that the depth of a
// file's hierarchy is no matter of the program's stack.
struct Frame {
    const std::string* name;
    const GdsCell* cell;
    Placement place = {};
    std::size_t reference = 0;
    int row = 0, column = 0;
};

struct Flattener {
    const GdsLibrary& library;
    int layer, datatype;
    std::map<const GdsCell*, Expansion> expansion = {};

    [[noreturn]] void fail(const std::string& what) const {
        throw FileError(fmt::format("{}: {}", library.file, what));
    }

    Frame frame(const std::string& name, const Placement& place = {}) const {
        const auto found = library.cells.find(name);
        if (found == library.cells.end()) fail(fmt::format("cell {}: there is none of that name", name));
        return {&found->first, &found->second, place};
    }

    bool wanted(const GdsShape& shape) const { return shape.layer == layer && shape.datatype == datatype; }

    // Counts what \p top and all below it become, those below first, and checks that none refers to itself.
    void count(const std::string& top) {
        std::set<const GdsCell*> open;  // those on the way down
        std::vector<Frame> path{frame(top)};
        open.insert(path.back().cell);
        while (!path.empty()) {
            Frame& at = path.back();
            if (at.reference < at.cell->references.size()) {
                const Frame below = frame(at.cell->references[at.reference].cell);
                if (open.contains(below.cell)) fail(fmt::format("cell {}: refers to itself", *below.name));
                if (expansion.contains(below.cell)) {
                    ++at.reference;
                } else {
                    open.insert(below.cell);
                    path.push_back(below);
                }
                continue;
            }
            Expansion sum;
            for (const GdsShape& shape : at.cell->shapes)
                if (wanted(shape)) {
                    sum.polygons += 1.0;
                    sum.corners += static_cast<double>(shape.polygon.size());
                }
            for (const GdsReference& r : at.cell->references) {
                const Expansion& below = expansion.at(frame(r.cell).cell);
                if (below.polygons == 0.0) continue;  // is not placed
                const double copies = static_cast<double>(r.columns) * r.rows;
                sum.placements += copies * below.placements;
                sum.polygons += copies * below.polygons;
                sum.corners += copies * below.corners;
            }
            open.erase(at.cell);
            expansion[at.cell] = sum;
            path.pop_back();
        }
    }

    void check(const std::string& top) const {
        const Expansion& all = expansion.at(frame(top).cell);
        const auto require = [&](double number, double most, const char* what) {
            if (number > most)
                fail(
                    fmt::format("cell {} becomes {:.3g} {} on layer {}, datatype {}, and {:g} is the most; "
                                "export the part that is simulated",
                                top, number, what, layer, datatype, most));
        };
        require(all.corners, kMostFlatCorners, "corners of polygons");
        require(all.polygons, kMostPolygons, "polygons");
        require(all.placements, kMostPlacements, "placed cells");
    }

    void add_shapes(const Frame& at, std::vector<levelset::Polygon>& polygons) const {
        for (const GdsShape& shape : at.cell->shapes) {
            if (!wanted(shape)) continue;
            levelset::Polygon& polygon = polygons.emplace_back();
            polygon.reserve(shape.polygon.size());
            for (const auto& p : shape.polygon) {
                const auto [x, y] = at.place.apply(p);
                if (!(std::hypot(x, y) * library.metres < kFarthest))
                    fail(fmt::format("cell {}: lies over a kilometre from the origin", *at.name));
                polygon.push_back({x * library.metres, y * library.metres});
            }
        }
    }

    // Cells in the order of their references, arrays row by row.
    std::vector<levelset::Polygon> flatten(const std::string& top) const {
        std::vector<levelset::Polygon> polygons;
        std::vector<Frame> path{frame(top)};
        add_shapes(path.back(), polygons);
        while (!path.empty()) {
            Frame& at = path.back();
            if (at.reference == at.cell->references.size()) {
                path.pop_back();
                continue;
            }
            const GdsReference& r = at.cell->references[at.reference];
            Frame below = frame(r.cell, at.place.of(r, at.column, at.row));
            const bool empty = expansion.at(below.cell).polygons == 0.0;
            if (++at.column == r.columns) at.column = 0, ++at.row;
            if (empty || at.row == r.rows) ++at.reference, at.column = at.row = 0;
            if (empty) continue;
            add_shapes(below, polygons);
            path.push_back(below);
        }
        return polygons;
    }
};

}  // namespace

std::vector<levelset::Polygon> flatten(const GdsLibrary& library, const std::string& cell, int layer,
                                       int datatype) {
    Flattener flattener{library, layer, datatype};
    flattener.count(cell);
    flattener.check(cell);
    return flattener.flatten(cell);
}

}  // namespace sidewall::app
