#include "app/recipe/layout/layout.hpp"

#include <fmt/format.h>

#include <zlib.h>
#include <cmath>

#include "app/recipe/layout/gds.hpp"
#include "app/recipe/layout/oasis.hpp"
#include "surface/error.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

constexpr std::size_t kMostCorners = 50'000'000;

void keep(Layout& layout, LayoutCell& cell, LayoutShape shape) {
    if ((layout.corners += shape.polygon.size()) > kMostCorners)
        throw FileError("{}: its cells hold over {} corners of polygons; export less of the chip",
                        layout.file, kMostCorners);
    cell.shapes.push_back(std::move(shape));
}

// Whether the points of a path follow each other on a straight line, within the rounding to database units.
bool is_straight(const levelset::Polygon& points) {
    constexpr double kRounded = 1.5;  // units that rounding may put a point off the line of two others
    if (points.size() < 2) return false;
    const auto [x, y] = points.front();
    const double dx = points.back()[0] - x, dy = points.back()[1] - y, length = std::hypot(dx, dy);
    double before = 0.0;
    for (const auto& p : points) {
        const double along = (p[0] - x) * dx + (p[1] - y) * dy, across = (p[0] - x) * dy - (p[1] - y) * dx;
        if (along < before || std::abs(across) > kRounded * length) return false;
        before = along;
    }
    return true;
}

constexpr std::size_t kMostBytes = 1'000'000'000;

constexpr double kMostPlacements = 1e7, kMostPolygons = 2e6, kMostFlatCorners = 2e7;
constexpr double kFarthest = 1e3;  // metres

// Affine map x -> m x + o.
struct Placement {
    double m[2][2] = {{1.0, 0.0}, {0.0, 1.0}};
    std::array<double, 2> o{0.0, 0.0};

    std::array<double, 2> apply(const std::array<double, 2>& p) const {
        return {m[0][0] * p[0] + m[0][1] * p[1] + o[0], m[1][0] * p[0] + m[1][1] * p[1] + o[1]};
    }
    Placement of(const CellReference& r, const std::array<double, 2>& offset) const {
        const double c = r.magnification * std::cos(r.angle), s = r.magnification * std::sin(r.angle),
                     flip = r.mirror ? -1.0 : 1.0;
        const double local[2][2] = {{c, -flip * s}, {s, flip * c}};
        Placement result;
        for (int i = 0; i < 2; ++i)
            for (int j = 0; j < 2; ++j) result.m[i][j] = m[i][0] * local[0][j] + m[i][1] * local[1][j];
        result.o = apply({r.origin[0] + offset[0], r.origin[1] + offset[1]});
        return result;
    }
    double magnification() const { return std::sqrt(std::abs(m[0][0] * m[1][1] - m[0][1] * m[1][0])); }
};

// What a cell expands to with all below it. In double: a hostile file may exceed any integer.
struct Expansion {
    double placements = 1.0, polygons = 0.0, corners = 0.0;
};

// A cell on the path from the top cell, and its next reference. The path is a list, not recursion, so that a
// deep hierarchy cannot overflow the stack.
struct Frame {
    const std::string* name;
    const LayoutCell* cell;
    Placement place = {};
    std::size_t reference = 0;
    std::uint64_t copy = 0;
};

struct Flattener {
    const Layout& layout;
    int layer, datatype;
    std::set<std::string>& missing;
    std::map<const LayoutCell*, Expansion> expansion = {};

    [[noreturn]] void fail(const std::string& what) const { throw FileError("{}: {}", layout.file, what); }

    // A frame at the cell of that name; its cell is null if the file lacks it.
    Frame frame(const std::string& name, const Placement& place = {}) const {
        const auto found = layout.cells.find(name);
        if (found == layout.cells.end()) return {nullptr, nullptr, place};
        return {&found->first, &found->second, place};
    }

    bool wanted(const auto& shape) const { return shape.layer == layer && shape.datatype == datatype; }

    double copies(std::uint32_t repetition) const {
        return static_cast<double>(layout.repetitions[repetition].count());
    }

    // Expansion of a cell; those of the cells below it are known.
    Expansion sum_of(const LayoutCell& cell) const {
        Expansion sum;
        for (const LayoutShape& shape : cell.shapes)
            if (wanted(shape)) {
                sum.polygons += copies(shape.repetition);
                sum.corners += copies(shape.repetition) * static_cast<double>(shape.polygon.size());
            }
        for (const AbsolutePath& path : cell.paths)
            if (wanted(path)) {
                // Upper bound: pieces of at least 32 points, six corners a bend, 100 for round ends.
                sum.polygons += 1.0 + static_cast<double>(path.points.size()) / 32.0;
                sum.corners += 100.0 + 8.0 * static_cast<double>(path.points.size());
            }
        for (const CellReference& r : cell.references) {
            const Frame at = frame(r.cell);
            if (at.cell == nullptr || expansion.at(at.cell).polygons == 0.0) continue;  // never placed
            const Expansion& below = expansion.at(at.cell);
            sum.placements += copies(r.repetition) * below.placements;
            sum.polygons += copies(r.repetition) * below.polygons;
            sum.corners += copies(r.repetition) * below.corners;
        }
        return sum;
    }

    // Computes the expansion of \p top and all cells below it, bottom up; refuses circular references.
    void count(const std::string& top) {
        std::set<const LayoutCell*> open;  // cells on the current path
        std::vector<Frame> path{frame(top)};
        if (path[0].cell == nullptr) fail(fmt::format("cell {}: there is none of that name", top));
        open.insert(path.back().cell);
        while (!path.empty()) {
            Frame& at = path.back();
            if (at.reference < at.cell->references.size()) {
                const std::string& name = at.cell->references[at.reference].cell;
                const Frame below = frame(name);
                if (below.cell == nullptr) missing.insert(name);
                if (open.contains(below.cell)) fail(fmt::format("cell {}: refers to itself", name));
                if (below.cell == nullptr || expansion.contains(below.cell)) {
                    ++at.reference;
                } else {
                    open.insert(below.cell);
                    path.push_back(below);
                }
                continue;
            }
            open.erase(at.cell);
            expansion[at.cell] = sum_of(*at.cell);
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

    void add(const Frame& at, const levelset::Polygon& corners, const std::array<double, 2>& offset,
             std::vector<levelset::Polygon>& polygons) const {
        levelset::Polygon& polygon = polygons.emplace_back();
        polygon.reserve(corners.size());
        for (const auto& p : corners) {
            const auto [x, y] = at.place.apply({p[0] + offset[0], p[1] + offset[1]});
            if (!(std::hypot(x, y) * layout.metres < kFarthest))
                fail(fmt::format("cell {}: lies over a kilometre from the origin", *at.name));
            polygon.push_back({x * layout.metres, y * layout.metres});
        }
    }

    void add_shapes(const Frame& at, std::vector<levelset::Polygon>& polygons) const {
        for (const LayoutShape& shape : at.cell->shapes) {
            if (!wanted(shape)) continue;
            const Repetition& again = layout.repetitions[shape.repetition];
            for (std::uint64_t k = 0; k < again.count(); ++k)
                add(at, shape.polygon, again.offset(k), polygons);
        }
        const double magnification = at.place.magnification();
        for (const AbsolutePath& path : at.cell->paths) {
            if (!wanted(path) || !(magnification > 0.0)) continue;
            levelset::PathStyle style = path.style;
            style.half_width /= magnification;
            if (path.square) style.begin = style.end = style.half_width;
            for (const levelset::Polygon& polygon : levelset::path_polygons(path.points, style))
                add(at, polygon, {}, polygons);
        }
    }

    // Polygons in the order of the references, arrays row by row.
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
            const CellReference& r = at.cell->references[at.reference];
            const Repetition& again = layout.repetitions[r.repetition];
            Frame below = frame(r.cell, at.place.of(r, again.offset(at.copy)));
            const bool empty = below.cell == nullptr || expansion.at(below.cell).polygons == 0.0;
            if (++at.copy == again.count() || empty) ++at.reference, at.copy = 0;
            if (empty) continue;
            add_shapes(below, polygons);
            path.push_back(below);
        }
        return polygons;
    }
};

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
    if (const levelset::Polygon& points = centre_line.polygon;
        style.half_width == 0.0 && is_straight(points)) {
        LayoutShape line = centre_line;
        line.polygon = {points.front(), points.front(), points.back(), points.back()};
        keep(layout, cell, std::move(line));
    }
    for (levelset::Polygon& polygon : levelset::path_polygons(centre_line.polygon, style))
        add_polygon(layout, cell,
                    {centre_line.layer, centre_line.datatype, std::move(polygon), centre_line.repetition});
}

void add_cell(Layout& layout, const std::string& name, LayoutCell cell) {
    if (name == "$$$CONTEXT_INFO$$$") return;
    if (!layout.cells.emplace(name, std::move(cell)).second)
        throw FileError("{}: cell {} is defined twice; export it again", layout.file, name);
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

Layout parse_layout(std::string_view bytes, const std::string& name) {
    if (bytes.starts_with("\x1f\x8b")) {
        const auto unpacked = inflated(bytes, Packing::gzip, kMostBytes);
        if (!unpacked)
            throw FileError("{}: its gzip data are damaged, or over {} bytes when unpacked", name,
                            kMostBytes);
        if (unpacked->starts_with("\x1f\x8b")) throw FileError("{}: is packed twice: unpack it once", name);
        return parse_layout(*unpacked, name);
    }
    if (bytes.starts_with(kOasisMagic)) return parse_oasis(bytes, name);
    // A GDSII file begins with a header record of six bytes.
    if (!bytes.starts_with(std::string_view("\0\6\0\2", 4)))
        throw FileError("{}: is neither GDSII nor OASIS, plain or in gzip; export one of these", name);
    return parse_gds(bytes, name);
}

Layout read_layout(const std::filesystem::path& path) {
    std::error_code failure;
    const std::uintmax_t size = std::filesystem::file_size(path, failure);
    if (failure) throw FileError("{}: cannot be read: {}", path.string(), failure.message());
    if (size > kMostBytes) throw FileError("{}: larger than {} bytes", path.string(), kMostBytes);
    return parse_layout(surface::read_whole_file(path), path.string());
}

std::optional<std::string> inflated(std::string_view packed, Packing packing, std::size_t most) {
    z_stream stream{};
    // zlib's window arguments: 16 more for gzip, negative for bare deflate data.
    if (inflateInit2(&stream, packing == Packing::gzip ? 16 + MAX_WBITS : -MAX_WBITS) != Z_OK) return {};
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
    stream.avail_in = static_cast<uInt>(packed.size());  // fits: files are below 1 GB
    std::string bytes;
    std::array<char, 65536> buffer{};
    int code = Z_OK;
    while (code == Z_OK && bytes.size() <= most) {
        stream.next_out = reinterpret_cast<Bytef*>(buffer.data());
        stream.avail_out = static_cast<uInt>(buffer.size());
        code = inflate(&stream, Z_NO_FLUSH);
        bytes.append(buffer.data(), buffer.size() - stream.avail_out);
        // A gzip file may consist of several members.
        const bool another = packing == Packing::gzip && code == Z_STREAM_END && stream.avail_in > 2 &&
                             stream.next_in[0] == 0x1f && stream.next_in[1] == 0x8b;
        if (another) code = inflateReset(&stream);
    }
    inflateEnd(&stream);
    if (code != Z_STREAM_END || bytes.size() > most) return {};
    return bytes;
}

std::vector<levelset::Polygon> flatten(const Layout& layout, const std::string& cell, int layer, int datatype,
                                       std::set<std::string>& missing) {
    Flattener flattener{layout, layer, datatype, missing};
    flattener.count(cell);
    flattener.check(cell);
    return flattener.flatten(cell);
}

}  // namespace sidewall::app
