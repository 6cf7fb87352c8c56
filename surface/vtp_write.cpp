#include <tbb/parallel_for.h>
#include <zlib.h>

#include "surface/mesh_bytes.hpp"
#include "surface/mesh_io.hpp"

namespace sidewall::surface {
namespace {

std::string escape(std::string_view text) {
    std::string result;
    for (const char c : text) {
        if (c == '&')
            result += "&amp;";
        else if (c == '<')
            result += "&lt;";
        else if (c == '>')
            result += "&gt;";
        else if (c == '"')
            result += "&quot;";
        else
            result += c;
    }
    return result;
}

std::string deflate_block(std::string_view block) {
    uLongf size = compressBound(static_cast<uLong>(block.size()));
    std::string out(size, '\0');
    const int code =
        compress2(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(block.data()),
                  static_cast<uLong>(block.size()), 5);
    if (code != Z_OK) throw IoError("cannot compress a mesh: out of memory");
    out.resize(size);
    return out;
}

/// vtkZLibDataCompressor's layout: block count, block size, last block's size if partial, compressed sizes,
/// blocks.
void append_compressed(std::string& appended, std::string_view bytes) {
    constexpr std::size_t kBlock = 1 << 18;
    const std::size_t count = (bytes.size() + kBlock - 1) / kBlock;
    std::vector<std::string> blocks(count);
    tbb::parallel_for(std::size_t{0}, count,
                      [&](std::size_t i) { blocks[i] = deflate_block(bytes.substr(i * kBlock, kBlock)); });
    append_value<std::uint64_t>(appended, count);
    append_value<std::uint64_t>(appended, kBlock);
    append_value<std::uint64_t>(appended, bytes.size() % kBlock);
    for (const std::string& block : blocks) append_value<std::uint64_t>(appended, block.size());
    for (const std::string& block : blocks) appended += block;
}

/// Collects the XML head and the appended data side by side.
struct Writer {
    std::string xml, appended;

    void array(const char* type, std::string_view name, int components, std::string_view bytes) {
        fmt::format_to(
            std::back_inserter(xml),
            "        <DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" "
            "offset=\"{}\"/>\n",
            type, escape(name), components, appended.size());
        append_compressed(appended, bytes);
    }

    void attributes(const char* element, const std::vector<Attribute>& attributes) {
        xml += fmt::format("      <{}>\n", element);
        for (const Attribute& attribute : attributes) {
            std::string bytes;
            bytes.reserve(8 * attribute.values.size());
            for (const double value : attribute.values) append_scalar(bytes, attribute.type, value);
            const char* type = attribute.type == Scalar::float32   ? "Float32"
                               : attribute.type == Scalar::float64 ? "Float64"
                                                                   : "Int32";
            array(type, attribute.name, attribute.components, bytes);
        }
        xml += fmt::format("      </{}>\n", element);
    }

    void field_data(const MeshMetadata& metadata) {
        if (metadata.texts.empty() && metadata.numbers.empty()) return;
        xml += "    <FieldData>\n";
        for (const auto& [name, text] : metadata.texts) {
            // VTK stores strings as the codes of their characters, each string ended by a zero.
            xml += fmt::format(
                "      <DataArray type=\"String\" Name=\"{}\" NumberOfTuples=\"1\" format=\"ascii\">",
                escape(name));
            for (const char c : text) xml += fmt::format("{} ", static_cast<unsigned char>(c));
            xml += "0</DataArray>\n";
        }
        for (const auto& [name, number] : metadata.numbers)
            xml += fmt::format(
                "      <DataArray type=\"Float64\" Name=\"{}\" NumberOfTuples=\"1\" "
                "format=\"ascii\">{}</DataArray>\n",
                escape(name), number);
        xml += "    </FieldData>\n";
    }
};

template <class Index>
void append_polys(Writer& writer, const char* type, const std::vector<Triangle>& triangles) {
    std::string connectivity, offsets;
    connectivity.reserve(3 * sizeof(Index) * triangles.size());
    offsets.reserve(sizeof(Index) * triangles.size());
    for (const Triangle& t : triangles)
        for (const std::uint32_t v : t) append_value(connectivity, static_cast<Index>(v));
    for (std::size_t t = 1; t <= triangles.size(); ++t) append_value(offsets, static_cast<Index>(3 * t));
    writer.array(type, "connectivity", 1, connectivity);
    writer.array(type, "offsets", 1, offsets);
}

}  // namespace

std::string encode_vtp(const TriangleMesh& mesh, const MeshMetadata& metadata) {
    check_written_mesh(mesh);
    Writer writer;
    writer.xml =
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" "
        "header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">\n  <PolyData>\n";
    writer.field_data(metadata);
    writer.xml += fmt::format(
        "    <Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" "
        "NumberOfPolys=\"{}\">\n",
        mesh.vertices.size(), mesh.triangles.size());
    writer.attributes("PointData", mesh.vertex_attributes);
    writer.attributes("CellData", mesh.triangle_attributes);

    std::string points;
    points.reserve(24 * mesh.vertices.size());
    for (const Vec3& p : mesh.vertices)
        for (int k = 0; k < 3; ++k) append_value(points, p[k]);
    writer.xml += "      <Points>\n";
    writer.array("Float64", "Points", 3, points);
    writer.xml += "      </Points>\n      <Polys>\n";
    if (mesh.triangles.size() < 0x7fffffffu / 3)
        append_polys<std::int32_t>(writer, "Int32", mesh.triangles);
    else
        append_polys<std::int64_t>(writer, "Int64", mesh.triangles);
    writer.xml += "      </Polys>\n    </Piece>\n  </PolyData>\n  <AppendedData encoding=\"raw\">\n   _";
    return writer.xml + writer.appended + "\n  </AppendedData>\n</VTKFile>\n";
}

}  // namespace sidewall::surface
