#include "surface/tetrahedra/tet_io.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "surface/files/file.hpp"
#include "surface/files/mesh_bytes.hpp"
#include "surface/files/mesh_io.hpp"
#include "surface/files/output_file.hpp"
#include "surface/files/vtk_writer.hpp"

namespace sidewall::surface {
namespace {

std::string joined(const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : ",") + name;
    return text;
}

void append_cells(VtkWriter& writer, const TetMesh& mesh) {
    constexpr std::uint8_t kTriangle = 5, kTetra = 10;  // VTK's numbers
    std::string connectivity, offsets, types;
    std::int64_t end = 0;
    const auto add = [&](const auto& corners, std::uint8_t type) {
        for (const std::uint32_t v : corners) append_value(connectivity, static_cast<std::int64_t>(v));
        end += static_cast<std::int64_t>(corners.size());
        append_value(offsets, end);
        append_value(types, type);
    };
    for (const Tetrahedron& t : mesh.tetrahedra) add(t, kTetra);
    for (const Triangle& t : mesh.triangles) add(t, kTriangle);
    writer.xml += "      <Cells>\n";
    writer.array("Int64", "connectivity", 1, std::move(connectivity));
    writer.array("Int64", "offsets", 1, std::move(offsets));
    writer.array("UInt8", "types", 1, std::move(types));
    writer.xml += "      </Cells>\n";
}

}  // namespace

std::string encode_vtu(const TetMesh& mesh, const MeshMetadata& metadata) {
    MeshMetadata named = metadata;
    named.texts.emplace_back("regions", joined(mesh.regions));
    named.texts.emplace_back("boundaries", joined(mesh.boundaries));
    VtkWriter writer("UnstructuredGrid");
    writer.field_data(named);
    writer.xml += fmt::format("    <Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n",
                              mesh.vertices.size(), mesh.tetrahedra.size() + mesh.triangles.size());
    std::vector<double> region(mesh.region.begin(), mesh.region.end()),
        boundary(mesh.tetrahedra.size(), -1.0);
    region.resize(mesh.tetrahedra.size() + mesh.triangles.size(), -1.0);
    boundary.insert(boundary.end(), mesh.boundary.begin(), mesh.boundary.end());
    writer.attributes("CellData", {{"region", 1, Scalar::int32, std::move(region)},
                                   {"boundary", 1, Scalar::int32, std::move(boundary)}});
    writer.points(mesh.vertices);
    append_cells(writer, mesh);
    return writer.file("UnstructuredGrid");
}

std::string encode_msh(const TetMesh& mesh) {
    std::string text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n";
    const auto out = std::back_inserter(text);
    const auto quoted = [](std::string name) {
        std::replace(name.begin(), name.end(), '"', '\'');
        return name;
    };
    // Groups of triangles are numbered from 1, those of tetrahedra after them.
    const std::size_t boundaries = mesh.boundaries.size();
    fmt::format_to(out, "{}\n", boundaries + mesh.regions.size());
    for (std::size_t b = 0; b < boundaries; ++b)
        fmt::format_to(out, "2 {} \"{}\"\n", b + 1, quoted(mesh.boundaries[b]));
    for (std::size_t r = 0; r < mesh.regions.size(); ++r)
        fmt::format_to(out, "3 {} \"{}\"\n", boundaries + r + 1, quoted(mesh.regions[r]));
    fmt::format_to(out, "$EndPhysicalNames\n$Nodes\n{}\n", mesh.vertices.size());
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
        fmt::format_to(out, "{} {} {} {}\n", v + 1, mesh.vertices[v].x(), mesh.vertices[v].y(),
                       mesh.vertices[v].z());
    fmt::format_to(out, "$EndNodes\n$Elements\n{}\n", mesh.triangles.size() + mesh.tetrahedra.size());
    std::size_t number = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto [a, b, c] = mesh.triangles[t];
        fmt::format_to(out, "{0} 2 2 {1} {1} {2} {3} {4}\n", ++number, mesh.boundary[t] + 1, a + 1, b + 1,
                       c + 1);
    }
    for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
        const auto [a, b, c, d] = mesh.tetrahedra[t];
        fmt::format_to(out, "{0} 4 2 {1} {1} {2} {3} {4} {5}\n", ++number,
                       boundaries + static_cast<std::size_t>(mesh.region[t]) + 1, a + 1, b + 1, c + 1, d + 1);
    }
    text += "$EndElements\n";
    return text;
}

void write_tets(const std::filesystem::path& path, const TetMesh& mesh, const MeshMetadata& metadata) {
    const std::string extension = lower_extension(path);
    if (extension != ".vtu" && extension != ".msh")
        throw FileError(fmt::format("{}: extension '{}' is no format of tetrahedra: use .vtu or .msh",
                                    path.string(), extension));
    write_whole_file(path, extension == ".vtu" ? encode_vtu(mesh, metadata) : encode_msh(mesh));
}

void write_vtm(const std::filesystem::path& path,
               const std::vector<std::pair<std::string, const TriangleMesh*>>& blocks,
               const MeshMetadata& metadata) {
    const std::filesystem::path folder = path.parent_path() / path.stem();
    std::string xml =
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"vtkMultiBlockDataSet\" version=\"1.0\" "
        "byte_order=\"LittleEndian\">\n  <vtkMultiBlockDataSet>\n";
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        const auto& [name, mesh] = blocks[k];
        const std::string file = fmt::format("block_{}.vtp", k);
        write_mesh(folder / file, *mesh, metadata);
        xml += fmt::format("    <DataSet index=\"{}\" name=\"{}\" file=\"{}/{}\"/>\n", k, xml_escape(name),
                           xml_escape(path.stem().string()), file);
    }
    write_whole_file(path, xml + "  </vtkMultiBlockDataSet>\n</VTKFile>\n");
}

}  // namespace sidewall::surface
