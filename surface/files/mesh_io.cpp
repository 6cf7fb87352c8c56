#include "surface/files/mesh_io.hpp"

#include <fmt/format.h>

#include "surface/error.hpp"
#include "surface/files/file.hpp"
#include "surface/files/obj.hpp"
#include "surface/files/output_file.hpp"
#include "surface/files/ply.hpp"
#include "surface/files/stl.hpp"
#include "surface/files/vtp.hpp"

namespace sidewall::surface {
namespace {

// The extension in lower case. Throws FileError unless it is that of a mesh format.
std::string format_of(const std::filesystem::path& path) {
    std::string extension = lower_extension(path);
    if (extension == ".vtp" || extension == ".ply" || extension == ".stl" || extension == ".obj")
        return extension;
    throw FileError("{}: extension '{}' is no mesh format: use .vtp, .ply, .stl or .obj", path.string(),
                    extension);
}

}  // namespace

TriangleMesh read_mesh(const std::filesystem::path& path, MeshMetadata* metadata) {
    const std::string format = format_of(path);
    const std::string bytes = read_whole_file(path);
    if (bytes.empty()) throw FileError("{}: is empty: export the surface again", path.string());
    if (format == ".ply") return decode_ply(bytes, path.string());
    if (format == ".stl") return decode_stl(bytes, path.string(), metadata);
    if (format == ".obj") return decode_obj(bytes, path.string(), metadata);
    return decode_vtp(bytes, path.string(), metadata);
}

void add_list(MeshMetadata& metadata, const std::string& name, const std::vector<std::string>& texts) {
    constexpr std::string_view kBetween("\0", 1);
    metadata.texts.emplace_back(name, fmt::format("{}", fmt::join(texts, kBetween)));
}

std::vector<std::string> unwritable(const std::filesystem::path& path, const TriangleMesh& mesh) {
    const std::string format = format_of(path);
    std::vector<std::string> names;
    if (format == ".vtp" || format == ".ply") return names;
    const std::string kept = format == ".stl" ? "attribute" : "material";
    for (const Attribute& a : mesh.vertex_attributes) names.push_back(a.name);
    for (const Attribute& a : mesh.triangle_attributes)
        if (a.name != kept || a.components != 1) names.push_back(a.name);
    return names;
}

void write_mesh(const std::filesystem::path& path, const TriangleMesh& mesh, const MeshMetadata& metadata) {
    const std::string format = format_of(path);
    write_whole_file(path, format == ".vtp"   ? encode_vtp(mesh, metadata)
                           : format == ".ply" ? encode_ply(mesh, metadata)
                           : format == ".stl" ? encode_stl(mesh)
                                              : encode_obj(mesh));
}

}  // namespace sidewall::surface
