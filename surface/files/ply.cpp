#include "surface/files/ply.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>

#include "surface/files/mesh_bytes.hpp"
#include "surface/files/polygons.hpp"

namespace sidewall::surface {
namespace {

struct Property {
    std::string name;
    FileScalar type = FileScalar::float32;
    std::optional<FileScalar> list_count;  ///< type of the count, if the property is a list
};

struct Element {
    std::string name;
    std::uint64_t count = 0;
    std::vector<Property> properties;
};

struct Header {
    bool ascii = false, big_endian = false;
    std::vector<Element> elements;
    std::size_t size = 0;  ///< bytes up to the data
};

FileScalar parse_type(const std::string& word, const std::string& where) {
    constexpr std::pair<std::string_view, FileScalar> kTypes[] = {
        {"char", FileScalar::int8},      {"uchar", FileScalar::uint8},    {"short", FileScalar::int16},
        {"ushort", FileScalar::uint16},  {"int", FileScalar::int32},      {"uint", FileScalar::uint32},
        {"float", FileScalar::float32},  {"double", FileScalar::float64}, {"int8", FileScalar::int8},
        {"uint8", FileScalar::uint8},    {"int16", FileScalar::int16},    {"uint16", FileScalar::uint16},
        {"int32", FileScalar::int32},    {"uint32", FileScalar::uint32},  {"float32", FileScalar::float32},
        {"float64", FileScalar::float64}};
    for (const auto& [name, type] : kTypes)
        if (name == word) return type;
    throw FileError("{}: type '{}' is unknown: export the surface again", where, word);
}

Header parse_header(std::string_view bytes, const std::string& name) {
    Header header;
    int line_number = 0;
    const auto where = [&] { return fmt::format("{}:{}", name, line_number); };
    const bool lone = bytes.starts_with("ply\r") && !bytes.starts_with("ply\r\n");  // CR ends all lines
    const auto header_line = [&] {
        const std::size_t end = bytes.find(lone ? '\r' : '\n', header.size);
        if (end == std::string_view::npos)
            throw FileError("{}: ends within its header: export the surface again", where());
        std::string line(bytes.substr(header.size, end - header.size));
        if (!line.empty() && line.back() == '\r') line.pop_back();
        header.size = end + 1;
        ++line_number;
        return line;
    };
    if (!bytes.starts_with("ply") || header_line() != "ply")
        throw FileError("{}: does not begin with 'ply': it is no PLY file", name);
    bool format_seen = false;
    for (;;) {
        std::istringstream line(header_line());
        std::string key, word, version;
        if (!(line >> key) || key == "comment" || key == "obj_info") continue;
        if (key == "end_header") break;
        if (key == "format") {
            line >> word >> version;
            header.ascii = word == "ascii";
            header.big_endian = word == "binary_big_endian";
            format_seen = header.ascii || header.big_endian || word == "binary_little_endian";
            if (!format_seen || version != "1.0")
                throw FileError("{}: format '{} {}' is unknown: save as binary 1.0", where(), word, version);
        } else if (key == "element") {
            Element element;
            line >> element.name >> word;
            if (!read_number(word, element.count))
                throw FileError("{}: element count '{}': must be a whole number", where(), word);
            header.elements.push_back(std::move(element));
        } else if (key == "property" && !header.elements.empty()) {
            Property property;
            line >> word;
            if (word == "list") {
                line >> word;
                property.list_count = parse_type(word, where());
                line >> word;
            }
            property.type = parse_type(word, where());
            if (!(line >> property.name))
                throw FileError("{}: property without a name: export the surface again", where());
            header.elements.back().properties.push_back(std::move(property));
        } else {
            throw FileError("{}: '{}' is no PLY header line: export the surface again", where(), key);
        }
    }
    if (!format_seen) throw FileError("{}: header has no format line: export the surface again", name);
    return header;
}

/// Reads values one after another, from text or bytes.
class Values {
  public:
    Values(const Header& header, std::string_view bytes, const std::string& name)
        : ascii_(header.ascii),
          big_endian_(header.big_endian),
          rest_(bytes.substr(header.size)),
          name_(name) {}

    double next(FileScalar type, const Element& element, std::uint64_t row) {
        if (ascii_) return next_word(element, row);
        const std::size_t size = byte_size(type);
        if (left() < size) cut_off(element, row);
        const double value = load_scalar(rest_.data(), type, big_endian_);
        rest_.remove_prefix(size);
        return value;
    }

    std::size_t left() const { return rest_.size(); }

    [[noreturn]] void cut_off(const Element& element, std::uint64_t row) const {
        throw FileError("{}: ends at {} {} of {}: the file is cut off; export the surface again", name_,
                        element.name, row, element.count);
    }

  private:
    double next_word(const Element& element, std::uint64_t row) {
        skip_space(rest_);
        if (rest_.empty()) cut_off(element, row);
        const auto value = next_number(rest_);
        if (!value)
            throw FileError("{}: {} {} has '{}' instead of a number: export the surface again", name_,
                            element.name, row, excerpt(rest_));
        return *value;
    }

    bool ascii_, big_endian_;
    std::string_view rest_;
    std::string name_;
};

/// The rows of an element, a column per property. Of lists only that of the faces is kept, in `cells`.
struct Columns {
    std::vector<std::vector<double>> values;  ///< per property; empty for lists
    CellTriangles cells;
};

constexpr std::string_view kStrips = "tristrips";

bool is_face_list(const Property& p) {
    return p.list_count && (p.name == "vertex_indices" || p.name == "vertex_index");
}

Columns read_element(Values& source, const Element& element, bool keep, const std::string& name) {
    // A declared count is refused if the file is too short for it, at one byte a value.
    const std::uint64_t row_bytes = std::max<std::size_t>(1, element.properties.size());
    if (element.count > (source.left() + 1) / row_bytes && !element.properties.empty())
        throw FileError("{}: declares {} of '{}', more than the file holds: it is cut off or damaged", name,
                        element.count, element.name);
    Columns columns;
    columns.values.resize(element.properties.size());
    if (element.properties.empty()) return columns;
    std::vector<std::uint32_t> polygon;
    for (std::uint64_t row = 0; row < element.count; ++row)
        for (std::size_t p = 0; p < element.properties.size(); ++p) {
            const Property& property = element.properties[p];
            if (!property.list_count) {
                const double value = source.next(property.type, element, row);
                if (keep) columns.values[p].push_back(value);
                continue;
            }
            const double count = source.next(*property.list_count, element, row);
            if (!(count >= 0.0) || count > static_cast<double>(source.left())) source.cut_off(element, row);
            const bool face = keep && is_face_list(property), strip = face && element.name == kStrips;
            polygon.clear();
            for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
                const double index = source.next(property.type, element, row);
                if (!face) continue;
                if (strip && index == -1.0) {  // ends a strip and begins the next
                    columns.cells.add_strip(polygon, static_cast<std::uint32_t>(row));
                    polygon.clear();
                    continue;
                }
                if (!(index >= 0.0) || index > 4294967294.0 || index != std::floor(index))
                    throw FileError("{}: face {} names vertex {}: the file is damaged", name, row, index);
                polygon.push_back(static_cast<std::uint32_t>(index));
            }
            if (strip) columns.cells.add_strip(polygon, static_cast<std::uint32_t>(row));
            if (!face || strip) continue;
            if (polygon.size() < 3)
                throw FileError("{}: face {} has {} vertices: must have at least 3", name, row,
                                polygon.size());
            columns.cells.add_polygon(polygon, static_cast<std::uint32_t>(row));
        }
    return columns;
}

/// Replaces blanks by \p space and all else but printable ASCII by '_': attribute names go into XML later.
std::string clean_name(std::string name, char space) {
    for (char& c : name)
        if (c <= ' ' || c > '~') c = c == ' ' ? space : '_';
    return name;
}

void take_attributes(const Element& element, Columns& columns, std::vector<Attribute>& attributes,
                     const std::vector<std::uint32_t>* cell, MemoryBudget& budget) {
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
        const Property& property = element.properties[p];
        if (property.list_count ||
            (!cell && (property.name == "x" || property.name == "y" || property.name == "z")))
            continue;
        const Scalar type = attribute_scalar(property.type, columns.values[p]);
        Attribute attribute{clean_name(property.name, '_'), 1, type, std::move(columns.values[p])};
        if (cell) {
            budget.take_doubles(static_cast<double>(cell->size()));
            take_elements(attribute, *cell);
        }
        attributes.push_back(std::move(attribute));
    }
}

void take_vertices(const Element& element, Columns& columns, TriangleMesh& mesh, const std::string& name,
                   MemoryBudget& budget) {
    for (int k = 0; k < 3; ++k) {
        const std::string axis(1, static_cast<char>('x' + k));
        const auto at = std::find_if(element.properties.begin(), element.properties.end(),
                                     [&](const Property& p) { return p.name == axis && !p.list_count; });
        if (at == element.properties.end())
            throw FileError("{}: its vertices have no {}: export the surface again", name, axis);
        const auto& column = columns.values[static_cast<std::size_t>(at - element.properties.begin())];
        mesh.vertices.resize(column.size());
        for (std::size_t i = 0; i < column.size(); ++i) mesh.vertices[i][k] = column[i];
    }
    take_attributes(element, columns, mesh.vertex_attributes, nullptr, budget);
}

}  // namespace

TriangleMesh decode_ply(std::string_view bytes, const std::string& name) {
    bytes = without_mark(bytes, name);
    const Header header = parse_header(bytes, name);
    Values source(header, bytes, name);
    MemoryBudget budget(name, bytes.size());
    TriangleMesh mesh;
    CellTriangles cells;
    bool vertices_seen = false;
    for (const Element& element : header.elements) {
        const bool vertex = element.name == "vertex" && !vertices_seen,
                   face = (element.name == "face" || element.name == kStrips) && cells.triangles.empty();
        if (element.count > 0xfffffffeu && !element.properties.empty())
            throw FileError("{}: declares {} of '{}': too many", name, element.count, element.name);
        Columns columns = read_element(source, element, vertex || face, name);
        if (vertex) take_vertices(element, columns, mesh, name, budget);
        if (face) {
            cells = std::move(columns.cells);
            mesh.triangle_attributes.clear();
            take_attributes(element, columns, mesh.triangle_attributes, &cells.cell, budget);
        }
        vertices_seen |= vertex;
    }
    triangulate_polygons(cells, mesh.vertices, name);
    mesh.triangles = std::move(cells.triangles);
    check_read_mesh(mesh, name);
    return mesh;
}

std::string encode_ply(const TriangleMesh& mesh, const MeshMetadata& metadata) {
    check_written_mesh(mesh);
    std::string bytes = "ply\nformat binary_little_endian 1.0\n";
    for (const auto& [name, text] : metadata.texts) {
        std::string shown = text;
        std::replace(shown.begin(), shown.end(), '\0', ',');  // separators of a list's items
        bytes += fmt::format("comment {}: {}\n", clean_name(name, '_'), clean_name(shown, ' '));
    }
    for (const auto& [name, number] : metadata.numbers)
        bytes += fmt::format("comment {}: {}\n", clean_name(name, '_'), number);
    const auto declare = [&](const std::vector<Attribute>& attributes) {
        for (const Attribute& a : attributes)
            for (int k = 0; k < a.components; ++k)
                bytes += fmt::format("property {} {}{}\n",
                                     a.type == Scalar::float32   ? "float"
                                     : a.type == Scalar::float64 ? "double"
                                                                 : "int",
                                     clean_name(a.name, '_'), a.components > 1 ? fmt::format("_{}", k) : "");
    };
    const auto append_row = [&](const std::vector<Attribute>& attributes, std::size_t row) {
        for (const Attribute& a : attributes) {
            const auto n = static_cast<std::size_t>(a.components);
            for (std::size_t k = 0; k < n; ++k) append_scalar(bytes, a.type, a.values[row * n + k]);
        }
    };
    bytes += fmt::format("element vertex {}\nproperty double x\nproperty double y\nproperty double z\n",
                         mesh.vertices.size());
    declare(mesh.vertex_attributes);
    bytes += fmt::format("element face {}\nproperty list uchar uint vertex_indices\n", mesh.triangles.size());
    declare(mesh.triangle_attributes);
    bytes += "end_header\n";
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        for (int k = 0; k < 3; ++k) append_value(bytes, mesh.vertices[i][k]);
        append_row(mesh.vertex_attributes, i);
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        append_value<std::uint8_t>(bytes, 3);
        for (const std::uint32_t v : mesh.triangles[t]) append_value(bytes, v);
        append_row(mesh.triangle_attributes, t);
    }
    return bytes;
}

}  // namespace sidewall::surface
