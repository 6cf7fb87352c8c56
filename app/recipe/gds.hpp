#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "levelset/shapes/polygon.hpp"

namespace sidewall::app {

/// One cell placed in another: scaled, mirrored about x, turned, then moved; repeated columns x rows times.
struct GdsReference {
    std::string cell;
    bool mirror = false;
    double magnification = 1.0;
    double angle = 0.0;                                         ///< radian, counter-clockwise
    std::array<double, 2> origin{}, column_step{}, row_step{};  ///< database units
    int columns = 1, rows = 1;
};

/// A polygon on a layer, in database units.
struct GdsShape {
    int layer = 0, datatype = 0;
    levelset::Polygon polygon;
};

struct GdsCell {
    std::vector<GdsShape> shapes;  ///< boundaries, boxes, and paths as a polygon a segment
    std::vector<GdsReference> references;
};

/// A GDSII stream file: cells by name.
struct GdsLibrary {
    std::string file;      ///< for messages
    double metres = 1e-9;  ///< length of a database unit
    std::map<std::string, GdsCell, std::less<>> cells;
};

/// Reads a library from its bytes. Texts, nodes and properties are skipped; round path ends become square
/// ones.
/// \param name  for messages.
/// \throws FileError for anything damaged, naming the byte, and for over 50 million corners of polygons.
GdsLibrary parse_gds(std::string_view bytes, const std::string& name);

/// Reads a library from a file.
/// \throws FileError as parse_gds, if it cannot be read or if it is larger than 1 GB.
GdsLibrary read_gds(const std::filesystem::path& path);

/// Cells that no other one refers to, in alphabetical order.
std::vector<std::string> top_cells(const GdsLibrary& library);

}  // namespace sidewall::app
