#include "surface/files/mesh_io.hpp"

#include <fmt/format.h>

#include <cmath>

#include "surface/files/file.hpp"
#include "surface/files/mesh_bytes.hpp"
#include "surface/files/output_file.hpp"

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

void check_read_mesh(const TriangleMesh& mesh, const std::string& name) {
    if (mesh.triangles.empty())
        throw FileError(fmt::format("{}: holds no triangle: export the surface as polygons", name));
    // Beyond this, squares of lengths leave the range of single precision, in which rays are traced.
    constexpr double kLargest = 1e15;
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        const Vec3& p = mesh.vertices[i];
        if (!p.allFinite())
            throw FileError(fmt::format("{}: vertex {} is ({}, {}, {}): not finite; export the surface again",
                                        name, i, p.x(), p.y(), p.z()));
        if (p.cwiseAbs().maxCoeff() > kLargest)
            throw FileError(
                fmt::format("{}: vertex {} lies beyond {}: choose a larger length unit", name, i, kLargest));
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (const std::uint32_t v : mesh.triangles[t])
            if (v >= mesh.vertices.size())
                throw FileError(fmt::format("{}: triangle {} names vertex {} of {}: the file is damaged",
                                            name, t, v, mesh.vertices.size()));
}

void check_written_mesh(const TriangleMesh& mesh) {
    const auto check = [](const std::vector<Attribute>& attributes, std::size_t count, const char* where) {
        for (const Attribute& a : attributes)
            if (a.components < 1 || a.values.size() != static_cast<std::size_t>(a.components) * count)
                throw GeometryError(fmt::format("{} attribute '{}' has {} values: must be {} x {}", where,
                                                a.name, a.values.size(), a.components, count));
    };
    check(mesh.vertex_attributes, mesh.vertices.size(), "vertex");
    check(mesh.triangle_attributes, mesh.triangles.size(), "triangle");
}

TriangleMesh read_mesh(const std::filesystem::path& path, MeshMetadata* metadata) {
    const Format format = format_of(path);
    const std::string bytes = read_whole_file(path);
    if (bytes.empty()) throw FileError(fmt::format("{}: is empty: export the surface again", path.string()));
    if (format == Format::ply) return decode_ply(bytes, path.string());
    if (format == Format::stl) return decode_stl(bytes, path.string(), metadata);
    if (format == Format::obj) return decode_obj(bytes, path.string(), metadata);
    return decode_vtp(bytes, path.string(), metadata);
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
