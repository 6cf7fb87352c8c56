#include <utility>

#include "surface/files/mesh_bytes.hpp"
#include "surface/files/mesh_io.hpp"
#include "surface/files/vtk_writer.hpp"

namespace sidewall::surface {
namespace {

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
    return writer.file("PolyData");
}

}  // namespace sidewall::surface
