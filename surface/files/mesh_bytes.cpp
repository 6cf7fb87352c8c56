#include "surface/files/mesh_bytes.hpp"

namespace sidewall::surface {

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

}  // namespace sidewall::surface
