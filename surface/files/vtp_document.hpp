#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "surface/files/mesh_bytes.hpp"

// Parses VTP files: the declarations of the XML, then data arrays on demand. Internal to the VTP reader.
namespace sidewall::surface::vtp {

struct DataArray {
    std::string name, type, format, text;  ///< text: inline ascii or base64 data
    std::uint64_t components = 1;
    std::uint64_t tuples = 0;  ///< declared for field data only
    std::uint64_t offset = 0;  ///< offset into the appended data
};

enum Section {
    kNone,
    kFieldData,
    kPointData,
    kCellData,
    kPoints,
    kVerts,
    kLines,
    kStrips,
    kPolys,
    kSections
};

struct Piece {
    std::uint64_t points = 0, verts = 0, lines = 0, strips = 0, polys = 0;
    std::array<std::vector<DataArray>, kSections> arrays;
};

struct Document {
    std::string name;  ///< file name, for messages
    bool big_endian = false;
    bool compressed = false;
    std::size_t header_size = 4;  ///< bytes of a word in array headers
    std::vector<DataArray> field_data;
    std::vector<Piece> pieces;
    bool appended_base64 = false;
    std::string_view appended;           ///< all bytes after the underscore that starts the data
    mutable MemoryBudget budget{"", 0};  ///< shared by the values of all arrays
};

/// Reads the declarations with expat, up to the appended data.
/// \throws FileError naming the file and line.
Document read_document(std::string_view bytes, const std::string& name);

/// The scalar type with a VTK name; nothing for strings and bits.
std::optional<FileScalar> scalar_type(std::string_view vtk_name);

/// All values of an array as doubles, decoded from inline text or the appended data.
/// \throws FileError if there are not exactly \p count values, if they are damaged, or, before decoding, if
///         they exceed the document's budget.
std::vector<double> read_values(const Document& document, const DataArray& array, std::uint64_t count);

}  // namespace sidewall::surface::vtp
