#include "simplify/vertex_kind.hpp"

#include <cmath>
#include <limits>

#include "surface/error.hpp"

namespace sidewall::simplify {
namespace {

// Flags vertices where triangles of different `material` meet.
std::vector<std::uint8_t> material_borders(const TriangleMesh& mesh) {
    std::vector<std::uint8_t> border(mesh.vertices.size(), 0);
    const Attribute* material = mesh.triangle_attribute("material");
    if (!material) return border;
    if (material->components != 1 || material->values.size() != mesh.triangles.size())
        throw GeometryError(
            "attribute `material` has {} values of {} components for {} triangles: give one "
            "number a triangle",
            material->values.size(), material->components, mesh.triangles.size());
    std::vector<double> seen(mesh.vertices.size(), std::numeric_limits<double>::quiet_NaN());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const double value = material->values[t];
        if (!std::isfinite(value))
            throw GeometryError("attribute `material` of triangle {} is not a number; repair the mesh", t);
        for (const std::uint32_t v : mesh.triangles[t]) {
            if (std::isnan(seen[v])) seen[v] = value;
            if (seen[v] != value) border[v] = 1;
        }
    }
    return border;
}

}  // namespace

std::vector<std::uint8_t> frozen_vertices(const TriangleMesh& mesh, std::span<const std::uint8_t> fixed) {
    std::vector<std::uint8_t> frozen = material_borders(mesh);
    if (!fixed.empty() && fixed.size() != frozen.size())
        throw GeometryError("{} flags of fixed vertices for {} vertices: give one a vertex", fixed.size(),
                            frozen.size());
    for (std::size_t v = 0; v < fixed.size(); ++v)
        if (fixed[v]) frozen[v] = 1;
    return frozen;
}

}  // namespace sidewall::simplify
