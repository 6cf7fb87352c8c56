#include "surface/files/vtp.hpp"

#include <sstream>
#include <utility>

#include "surface/files/mesh_bytes.hpp"
#include "surface/files/polygons.hpp"
#include "surface/files/vtk_writer.hpp"
#include "surface/files/vtp_document.hpp"
#include "surface/topology.hpp"

namespace sidewall::surface {
namespace {

using vtp::DataArray;
using vtp::Document;
using vtp::Piece;

const DataArray& find_array(const Document& document, const std::vector<DataArray>& arrays,
                            std::string_view name, std::string_view section) {
    for (const DataArray& array : arrays)
        if (array.name == name) return array;
    throw FileError("{}: {} has no array '{}': the file is damaged; export the surface again", document.name,
                    section, name);
}

/// The cells of Polys or Strips, each a list of vertex indices of the piece.
Rows read_cells(const Document& document, const Piece& piece, vtp::Section section, std::uint64_t count,
                std::string_view name) {
    Rows cells;
    if (count == 0) return cells;
    const auto fail = [&](const std::string& what) {
        throw FileError("{}: {}: {}; export the surface again", document.name, name, what);
    };
    const auto& arrays = piece.arrays[section];
    for (const double end :
         vtp::read_values(document, find_array(document, arrays, "offsets", name), count)) {
        if (!(end >= cells.offsets.back() + 3.0) || end > 4294967295.0)
            fail(fmt::format("cell {} has fewer than 3 vertices", cells.size()));
        cells.offsets.push_back(static_cast<std::uint32_t>(end));
    }
    for (const double v : vtp::read_values(document, find_array(document, arrays, "connectivity", name),
                                           cells.offsets.back())) {
        if (!(v >= 0.0) || v >= static_cast<double>(piece.points))
            fail(fmt::format("a cell names vertex {} of {}", v, piece.points));
        cells.items.push_back(static_cast<std::uint32_t>(v));
    }
    return cells;
}

/// Attributes of a section. \p element, if given, lists the stored elements whose values the new ones take.
std::vector<Attribute> read_attributes(const Document& document, const std::vector<DataArray>& arrays,
                                       std::uint64_t stored, const std::vector<std::uint32_t>* element) {
    std::vector<Attribute> attributes;
    for (const DataArray& array : arrays) {
        const auto type = vtp::scalar_type(array.type);
        if (!type || array.name.empty()) continue;
        Attribute attribute{array.name, static_cast<int>(array.components), Scalar::float64, {}};
        attribute.values = vtp::read_values(document, array, stored * array.components);
        attribute.type = attribute_scalar(*type, attribute.values);
        if (element) {
            document.budget.take_doubles(static_cast<double>(element->size()) *
                                         static_cast<double>(array.components));
            take_elements(attribute, *element);
        }
        attributes.push_back(std::move(attribute));
    }
    return attributes;
}

TriangleMesh read_piece(const Document& document, const Piece& piece) {
    if (piece.verts > 0 || piece.lines > 0)
        throw FileError("{}: holds {} vertex and {} line cells: keep only its polygons", document.name,
                        piece.verts, piece.lines);
    constexpr std::uint64_t kMost = 0xfffffffeu;
    if (piece.points > kMost || piece.strips > kMost || piece.polys > kMost)
        throw FileError("{}: declares more than {} points or cells: the file is damaged or too large",
                        document.name, kMost);
    TriangleMesh mesh;
    const auto& point_arrays = piece.arrays[vtp::kPoints];
    if (piece.points > 0) {
        if (point_arrays.empty() || point_arrays[0].components != 3)
            throw FileError("{}: Points is no array of 3 components: export the surface again",
                            document.name);
        const auto xyz = vtp::read_values(document, point_arrays[0], 3 * piece.points);
        mesh.vertices.resize(piece.points);
        for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
            mesh.vertices[i] = Vec3(xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]);
    }
    // Cell data lists strips before polygons.
    CellTriangles cells;
    const Rows strips = read_cells(document, piece, vtp::kStrips, piece.strips, "Strips");
    const Rows polys = read_cells(document, piece, vtp::kPolys, piece.polys, "Polys");
    for (std::size_t i = 0; i < strips.size(); ++i) cells.add_strip(strips[i], static_cast<std::uint32_t>(i));
    for (std::size_t i = 0; i < polys.size(); ++i)
        cells.add_polygon(polys[i], static_cast<std::uint32_t>(strips.size() + i));
    triangulate_polygons(cells, mesh.vertices, document.name);
    mesh.triangles = std::move(cells.triangles);
    mesh.vertex_attributes = read_attributes(document, piece.arrays[vtp::kPointData], piece.points, nullptr);
    mesh.triangle_attributes =
        read_attributes(document, piece.arrays[vtp::kCellData], piece.strips + piece.polys, &cells.cell);
    return mesh;
}

/// Appends the values of attributes that both lists have with equally many components; drops the others.
void append_attributes(std::vector<Attribute>& all, const std::vector<Attribute>& more) {
    std::erase_if(all, [&](Attribute& a) {
        for (const Attribute& b : more)
            if (a.name == b.name && a.components == b.components) {
                a.values.insert(a.values.end(), b.values.begin(), b.values.end());
                if (a.type != b.type) a.type = Scalar::float64;
                return false;
            }
        return true;
    });
}

void append(TriangleMesh& all, const TriangleMesh& piece, const std::string& name) {
    const std::size_t base = all.vertices.size();
    if (base + piece.vertices.size() > 0xfffffffeu)
        throw FileError("{}: has more than {} points: it is too large", name, 0xfffffffeu);
    all.vertices.insert(all.vertices.end(), piece.vertices.begin(), piece.vertices.end());
    for (Triangle t : piece.triangles) {
        for (std::uint32_t& v : t) v += static_cast<std::uint32_t>(base);
        all.triangles.push_back(t);
    }
    append_attributes(all.vertex_attributes, piece.vertex_attributes);
    append_attributes(all.triangle_attributes, piece.triangle_attributes);
}

MeshMetadata read_metadata(const Document& document) {
    MeshMetadata metadata;
    for (const DataArray& array : document.field_data) {
        if (array.components != 1) continue;
        if (array.type == "String" && array.format == "ascii") {
            std::istringstream codes(array.text);
            std::string text;
            for (int code = 0; codes >> code && code >= 0 && code < 256;)
                text += static_cast<char>(static_cast<unsigned char>(code));
            if (text.ends_with('\0')) text.pop_back();  // end of the last string
            metadata.texts.emplace_back(array.name, text);
        } else if (array.tuples == 1 && vtp::scalar_type(array.type)) {
            metadata.numbers.emplace_back(array.name, vtp::read_values(document, array, 1).front());
        }
    }
    return metadata;
}

template <class Index>
void append_polys(VtkWriter& writer, const char* type, const std::vector<Triangle>& triangles) {
    std::string connectivity, offsets;
    connectivity.reserve(3 * sizeof(Index) * triangles.size());
    offsets.reserve(sizeof(Index) * triangles.size());
    for (const Triangle& t : triangles)
        for (const std::uint32_t v : t) append_value(connectivity, static_cast<Index>(v));
    for (std::size_t t = 1; t <= triangles.size(); ++t) append_value(offsets, static_cast<Index>(3 * t));
    writer.array(type, "connectivity", 1, std::move(connectivity));
    writer.array(type, "offsets", 1, std::move(offsets));
}

}  // namespace

TriangleMesh decode_vtp(std::string_view bytes, const std::string& name, MeshMetadata* metadata) {
    const Document document = vtp::read_document(bytes, name);
    TriangleMesh mesh;
    bool first = true;
    for (const Piece& piece : document.pieces) {
        if (piece.points == 0 && piece.polys == 0 && piece.strips == 0) continue;
        TriangleMesh part = read_piece(document, piece);
        if (first)
            mesh = std::move(part);
        else
            append(mesh, part, name);
        first = false;
    }
    check_read_mesh(mesh, name);
    if (metadata) *metadata = read_metadata(document);
    return mesh;
}

std::string encode_vtp(const TriangleMesh& mesh, const MeshMetadata& metadata) {
    check_written_mesh(mesh);
    VtkWriter writer("PolyData");
    writer.field_data(metadata);
    writer.xml += fmt::format(
        "    <Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" "
        "NumberOfPolys=\"{}\">\n",
        mesh.vertices.size(), mesh.triangles.size());
    writer.attributes("PointData", mesh.vertex_attributes);
    writer.attributes("CellData", mesh.triangle_attributes);
    writer.points(mesh.vertices);
    writer.xml += "      <Polys>\n";
    if (mesh.triangles.size() < 0x7fffffffu / 3)
        append_polys<std::int32_t>(writer, "Int32", mesh.triangles);
    else
        append_polys<std::int64_t>(writer, "Int64", mesh.triangles);
    writer.xml += "      </Polys>\n";
    return writer.file();
}

}  // namespace sidewall::surface
