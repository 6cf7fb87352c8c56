#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "levelset/shapes/polygon.hpp"
#include "levelset/shapes/polygon_clipping.hpp"

namespace sidewall::app {

/// Offsets of an element's copies, in database units: an array of columns x rows, or a list.
struct Repetition {
    std::uint64_t columns = 1, rows = 1;
    std::array<double, 2> column_step{}, row_step{};
    std::vector<std::array<double, 2>> places;  ///< offsets as a list; if not empty, replaces the array

    std::uint64_t count() const { return places.empty() ? columns * rows : places.size(); }
    std::array<double, 2> offset(std::uint64_t k) const;
};

/// A cell placed in another: scaled, mirrored about the x axis, rotated, then moved.
struct CellReference {
    std::string cell;
    bool mirror = false;
    double magnification = 1.0;
    double angle = 0.0;              ///< radian, counter-clockwise
    std::array<double, 2> origin{};  ///< database units
    std::uint32_t repetition = 0;    ///< index in Layout::repetitions
};

/// A polygon on a layer, in database units; filled by the even-odd rule where it crosses itself.
struct LayoutShape {
    int layer = 0, datatype = 0;
    levelset::Polygon polygon;
    std::uint32_t repetition = 0;  ///< index in Layout::repetitions
};

/// A path whose width does not scale with its cell's magnification; it is expanded when the cell is placed.
struct AbsolutePath {
    int layer = 0, datatype = 0;
    levelset::Polygon points;
    levelset::PathStyle style;
    bool square = false;  ///< ends extend by half the width
};

struct LayoutCell {
    std::vector<LayoutShape> shapes;
    std::vector<AbsolutePath> paths;
    std::vector<CellReference> references;
};

/// Contents of a layout file of either format: cells by name, without texts and properties.
struct Layout {
    std::string file;      ///< name for messages
    double metres = 1e-9;  ///< length of a database unit
    std::map<std::string, LayoutCell, std::less<>> cells;
    std::vector<Repetition> repetitions{1};  ///< index 0 is a single copy
    std::size_t corners = 0;                 ///< number of all shapes' corners
};

/// Adds a polygon to a cell without repeated corners, unless fewer than three remain.
/// \throws FileError when the layout's cells have over 50 million corners.
void add_polygon(Layout& layout, LayoutCell& cell, LayoutShape shape);

/// Adds the polygons of a path to a cell, none for a path without length or width. A straight line without
/// width, as drawn to measure along, becomes a polygon without area.
/// \throws FileError as add_polygon.
void add_path(Layout& layout, LayoutCell& cell, const LayoutShape& centre_line,
              const levelset::PathStyle& style);

/// Adds a cell, except $$$CONTEXT_INFO$$$, in which KLayout stores its own data.
/// \throws FileError if the layout has a cell of that name.
void add_cell(Layout& layout, const std::string& name, LayoutCell cell);

/// Cells that no cell refers to, in alphabetical order.
std::vector<std::string> top_cells(const Layout& layout);

/// Parses a layout: GDSII or OASIS 1.0, plain or packed by gzip, recognised by its bytes.
/// \param name  for messages.
/// \throws FileError for other formats, for over 1 GB unpacked, and as parse_gds and parse_oasis.
Layout parse_layout(std::string_view bytes, const std::string& name);

/// Reads a layout from a file.
/// \throws FileError as parse_layout, and if the file cannot be read or is larger than 1 GB.
Layout read_layout(const std::filesystem::path& path);

/// Format of data packed by zlib: bare deflate data, or a gzip file.
enum class Packing { deflate, gzip };

/// Unpacks bytes. No value if they are damaged, cut off, or more than \p most when unpacked.
std::optional<std::string> inflated(std::string_view packed, Packing packing, std::size_t most);

/// All polygons of a layer and datatype in \p cell and the cells it refers to, in metres.
/// \param missing  receives the names of cells that are referred to but not in the file; they stay empty.
/// \throws FileError naming the file for an unknown cell, circular references, a polygon over a kilometre
///         from the origin; and, before anything is placed, for over 10 million placed cells, 2 million
///         polygons or 20 million corners. The depth of the hierarchy is not limited.
std::vector<levelset::Polygon> flatten(const Layout& layout, const std::string& cell, int layer, int datatype,
                                       std::set<std::string>& missing);

}  // namespace sidewall::app
