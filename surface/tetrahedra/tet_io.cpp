#include "surface/tetrahedra/tet_io.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "surface/files/file.hpp"
#include "surface/files/mesh_bytes.hpp"
#include "surface/files/mesh_io.hpp"
#include "surface/files/output_file.hpp"
#include "surface/files/vtk_writer.hpp"

namespace sidewall::surface {
namespace {

// Writes a number per cell, -1 for none, and a second array with the names that the numbers stand for.
void append_named(VtkWriter& writer, const std::string& name, const std::vector<int>& cells,
                  const std::vector<std::string>& names) {
    std::string numbers, texts;
    for (const int cell : cells) {
        append_value(numbers, cell);
        if (cell >= 0) texts += names[static_cast<std::size_t>(cell)];
        texts += '\0';
    }
    writer.array("Int32", name, 1, std::move(numbers));
    writer.array("String", name + "_name", 1, std::move(texts));
}

template <class Cells, class Borders>
void append_cells(VtkWriter& writer, const Cells& cells, const Borders& borders) {
    constexpr std::array<std::uint8_t, 5> kTypes{0, 0, 3, 5, 10};  // VTK's cell types by number of corners
    std::string connectivity, offsets, types;
    std::int64_t end = 0;
    const auto add = [&](const auto& corners) {
        for (const std::uint32_t v : corners) append_value(connectivity, static_cast<std::int64_t>(v));
        end += static_cast<std::int64_t>(corners.size());
        append_value(offsets, end);
        append_value(types, kTypes[corners.size()]);
    };
    for (const auto& cell : cells) add(cell);
    for (const auto& border : borders) add(border);
    writer.xml += "      <Cells>\n";
    writer.array("Int64", "connectivity", 1, std::move(connectivity));
    writer.array("Int64", "offsets", 1, std::move(offsets));
    writer.array("UInt8", "types", 1, std::move(types));
    writer.xml += "      </Cells>\n";
}

template <class Mesh, class Cells, class Borders>
std::string vtu_of(const Mesh& mesh, const Cells& cells, const Borders& borders,
                   const MeshMetadata& metadata) {
    MeshMetadata named = metadata;
    add_list(named, "regions", mesh.regions);
    add_list(named, "boundaries", mesh.boundaries);
    VtkWriter writer("UnstructuredGrid");
    writer.field_data(named);
    const std::size_t inner = cells.size(), all = inner + borders.size();
    writer.xml +=
        fmt::format("    <Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n", mesh.vertices.size(), all);
    std::vector<int> region = mesh.region, boundary(inner, -1);
    region.resize(all, -1);
    boundary.insert(boundary.end(), mesh.boundary.begin(), mesh.boundary.end());
    writer.xml += "      <CellData>\n";
    append_named(writer, "region", region, mesh.regions);
    append_named(writer, "boundary", boundary, mesh.boundaries);
    writer.xml += "      </CellData>\n";
    writer.points(mesh.vertices);
    append_cells(writer, cells, borders);
    return writer.file();
}

template <class Mesh, class Cells, class Borders>
std::string msh_of(const Mesh& mesh, const Cells& cells, const Borders& borders) {
    std::string text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n";
    const auto out = std::back_inserter(text);
    // Groups of borders are numbered from 1, those of cells after them.
    const std::size_t boundaries = mesh.boundaries.size();
    constexpr std::size_t kDimension = std::tuple_size_v<typename Cells::value_type> - 1;
    fmt::format_to(out, "{}\n", boundaries + mesh.regions.size());
    std::size_t group = 0;
    for (const auto* names : {&mesh.boundaries, &mesh.regions})
        for (std::string name : *names) {
            std::replace(name.begin(), name.end(), '"', '\'');
            ++group;
            fmt::format_to(out, "{} {} \"{}\"\n", kDimension - (group <= boundaries ? 1 : 0), group, name);
        }
    fmt::format_to(out, "$EndPhysicalNames\n$Nodes\n{}\n", mesh.vertices.size());
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
        fmt::format_to(out, "{} {} {} {}\n", v + 1, mesh.vertices[v].x(), mesh.vertices[v].y(),
                       mesh.vertices[v].z());
    fmt::format_to(out, "$EndNodes\n$Elements\n{}\n", borders.size() + cells.size());
    std::size_t number = 0;
    const auto add = [&](const auto& corners, std::size_t of_group) {
        constexpr std::array<int, 5> kTypes{0, 0, 1, 2, 4};  // Gmsh's element types by corners
        fmt::format_to(out, "{0} {1} 2 {2} {2}", ++number, kTypes[corners.size()], of_group);
        for (const std::uint32_t v : corners) fmt::format_to(out, " {}", v + 1);
        text += '\n';
    };
    for (std::size_t b = 0; b < borders.size(); ++b)
        add(borders[b], static_cast<std::size_t>(mesh.boundary[b]) + 1);
    for (std::size_t c = 0; c < cells.size(); ++c)
        add(cells[c], boundaries + static_cast<std::size_t>(mesh.region[c]) + 1);
    return text + "$EndElements\n";
}

template <class Mesh, class Cells, class Borders>
void write_cells(const std::filesystem::path& path, const Mesh& mesh, const Cells& cells,
                 const Borders& borders, const MeshMetadata& metadata) {
    const std::string extension = lower_extension(path);
    if (extension != ".vtu" && extension != ".msh")
        throw FileError("{}: extension '{}' is no format of tetrahedra: use .vtu or .msh", path.string(),
                        extension);
    write_whole_file(
        path, extension == ".vtu" ? vtu_of(mesh, cells, borders, metadata) : msh_of(mesh, cells, borders));
}

}  // namespace

void write_tets(const std::filesystem::path& path, const TetMesh& mesh, const MeshMetadata& metadata) {
    write_cells(path, mesh, mesh.tetrahedra, mesh.triangles, metadata);
}

void write_plane(const std::filesystem::path& path, const PlaneMesh& mesh, const MeshMetadata& metadata) {
    write_cells(path, mesh, mesh.triangles, mesh.edges, metadata);
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
