#include "surface/files/mesh_io.hpp"

#include <fmt/format.h>

#include <utility>

#include "surface/error.hpp"
#include "surface/files/file.hpp"
#include "surface/files/obj.hpp"
#include "surface/files/output_file.hpp"
#include "surface/files/ply.hpp"
#include "surface/files/stl.hpp"
#include "surface/files/vtp.hpp"

namespace sidewall::surface {
namespace {

enum class Format { vtp, ply, stl, obj };

Format format_of(const std::filesystem::path& path) {
    const std::string extension = lower_extension(path);
    if (extension == ".vtp") return Format::vtp;
    if (extension == ".ply") return Format::ply;
    if (extension == ".stl") return Format::stl;
    if (extension == ".obj") return Format::obj;
    throw FileError(fmt::format("{}: extension '{}' is no mesh format: use .vtp, .ply, .stl or .obj",
                                path.string(), extension));
}

}  // namespace

TriangleMesh read_mesh(const std::filesystem::path& path, MeshMetadata* metadata) {
    const Format format = format_of(path);
    const std::string bytes = read_whole_file(path);
    if (bytes.empty()) throw FileError(fmt::format("{}: is empty: export the surface again", path.string()));
    if (format == Format::ply) return decode_ply(bytes, path.string());
    if (format == Format::stl) return decode_stl(bytes, path.string(), metadata);
    if (format == Format::obj) return decode_obj(bytes, path.string(), metadata);
    return decode_vtp(bytes, path.string(), metadata);
}

void add_list(MeshMetadata& metadata, const std::string& name, const std::vector<std::string>& texts) {
    std::string list;
    for (std::size_t k = 0; k < texts.size(); ++k) {
        if (k > 0) list += '\0';
        list += texts[k];
    }
    metadata.texts.emplace_back(name, std::move(list));
}

std::vector<std::string> unwritable(const std::filesystem::path& path, const TriangleMesh& mesh) {
    const Format format = format_of(path);
    std::vector<std::string> names;
    if (format == Format::vtp || format == Format::ply) return names;
    const std::string kept = format == Format::stl ? "attribute" : "material";
    for (const Attribute& a : mesh.vertex_attributes) names.push_back(a.name);
    for (const Attribute& a : mesh.triangle_attributes)
        if (a.name != kept || a.components != 1) names.push_back(a.name);
    return names;
}

void write_mesh(const std::filesystem::path& path, const TriangleMesh& mesh, const MeshMetadata& metadata) {
    const Format format = format_of(path);
    write_whole_file(path, format == Format::vtp   ? encode_vtp(mesh, metadata)
                           : format == Format::ply ? encode_ply(mesh, metadata)
                           : format == Format::stl ? encode_stl(mesh)
                                                   : encode_obj(mesh));
}

}  // namespace sidewall::surface
