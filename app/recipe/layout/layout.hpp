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

/// Copies of an element, by their offsets in database units: in columns x rows, or in a list of places.
struct Repetition {
    std::uint64_t columns = 1, rows = 1;
    std::array<double, 2> column_step{}, row_step{};
    std::vector<std::array<double, 2>> places;  ///< if any, instead

    std::uint64_t count() const { return places.empty() ? columns * rows : places.size(); }
    std::array<double, 2> offset(std::uint64_t k) const;
};

/// One cell placed in another: scaled, mirrored about x, turned, then moved.
struct CellReference {
    std::string cell;
    bool mirror = false;
    double magnification = 1.0;
    double angle = 0.0;              ///< radian, counter-clockwise
    std::array<double, 2> origin{};  ///< database units
    std::uint32_t repetition = 0;    ///< number in Layout::repetitions
};

/// A polygon on a layer, in database units; even-odd where it crosses itself.
struct LayoutShape {
    int layer = 0, datatype = 0;
    levelset::Polygon polygon;
    std::uint32_t repetition = 0;  ///< number in Layout::repetitions
};

/// A path whose width no magnification changes, which makes its polygons when it is placed.
struct AbsolutePath {
    int layer = 0, datatype = 0;
    levelset::Polygon points;
    levelset::PathStyle style;
    bool square = false;  ///< reaches half its width beyond its ends
};

struct LayoutCell {
    std::vector<LayoutShape> shapes;
    std::vector<AbsolutePath> paths;
    std::vector<CellReference> references;
};

/// What a layout file holds, whatever its format: cells by name. Texts and properties are left out.
struct Layout {
    std::string file;      ///< for messages
    double metres = 1e-9;  ///< length of a database unit
    std::map<std::string, LayoutCell, std::less<>> cells;
    std::vector<Repetition> repetitions{1};  ///< the first one is a single place
    std::size_t corners = 0;                 ///< of all shapes
};

/// Adds a polygon to a cell, without corners that repeat the one before; if fewer than three are left, it has no area and
/// is left out.
/// \throws FileError when the layout's cells have over 50 million corners.
void add_polygon(Layout& layout, LayoutCell& cell, LayoutShape shape);

/// Adds the polygons of a path to a cell; none where it has no width or length. A line of two points without width, as lines
/// to measure along are drawn, becomes a polygon without area.
/// \throws FileError as add_polygon.
void add_path(Layout& layout, LayoutCell& cell, const LayoutShape& centre_line,
              const levelset::PathStyle& style);

/// Adds a cell. The one in which KLayout keeps data of its own, $$$CONTEXT_INFO$$$, is no layout and is dropped.
/// \throws FileError if the layout has one of that name.
void add_cell(Layout& layout, const std::string& name, LayoutCell cell);

/// Cells that no other one refers to, in alphabetical order.
std::vector<std::string> top_cells(const Layout& layout);

/// Reads a layout from its bytes: GDSII, or OASIS 1.0, either packed by gzip, too, whatever it is called.
/// \param name  for messages.
/// \throws FileError for another format, over 1 GB unpacked, and as the format's parser.
Layout parse_layout(std::string_view bytes, const std::string& name);

/// Reads a layout from a file.
/// \throws FileError as parse_layout, if it cannot be read or if it is larger than 1 GB.
Layout read_layout(const std::filesystem::path& path);

/// How bytes are packed by zlib: bare, or in a gzip file.
enum class Packing { deflate, gzip };

/// Unpacks bytes; nothing if they are damaged, cut off or more than \p most when unpacked.
std::optional<std::string> inflated(std::string_view packed, Packing packing, std::size_t most);

/// All polygons of a layer and datatype in \p cell and the cells it refers to, in metres.
/// \param missing  takes the names of cells that are referred to and that the file lacks; nothing is drawn of them.
/// \throws FileError naming the file for an unknown cell, references in a circle, a polygon over a kilometre
///         from the origin, and, before anything is placed, for over 10 million cells placed, 2 million polygons or
///         20 million corners. The hierarchy may be of any depth.
std::vector<levelset::Polygon> flatten(const Layout& layout, const std::string& cell, int layer, int datatype,
                                       std::set<std::string>& missing);

}  // namespace sidewall::app
