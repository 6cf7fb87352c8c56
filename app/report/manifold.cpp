#include "app/report/manifold.hpp"

#include <algorithm>
#include <map>

#include "surface/disjoint_sets.hpp"
#include "surface/topology.hpp"

namespace sidewall::app {
namespace {

// Removes pairs of triangles with the same three vertices.
TriangleMesh without_folds(const TriangleMesh& mesh) {
    std::map<Triangle, std::size_t> open;  // unpaired triangles by their sorted vertices
    std::vector<std::uint8_t> kept(mesh.triangles.size(), 1);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        Triangle key = mesh.triangles[t];
        std::sort(key.begin(), key.end());
        const auto [place, fresh] = open.try_emplace(key, t);
        if (fresh) continue;
        kept[t] = kept[place->second] = 0;
        open.erase(place);
    }
    const Attribute* material = mesh.triangle_attribute("material");
    TriangleMesh result{.vertices = mesh.vertices};
    Attribute of_kept{"material", 1, Scalar::int32, {}};
    for (std::size_t t = 0; t < kept.size(); ++t) {
        if (!kept[t]) continue;
        result.triangles.push_back(mesh.triangles[t]);
        if (material) of_kept.values.push_back(material->values[t]);
    }
    if (material) result.triangle_attributes.push_back(std::move(of_kept));
    return result;
}

}  // namespace

TriangleMesh manifold_parts(const TriangleMesh& mesh) {
    TriangleMesh result = without_folds(mesh);
    // Corners at a vertex stay together where their triangles share an edge with no third triangle.
    surface::DisjointSets corners(3 * result.triangles.size());
    const auto corner_at = [&](std::uint32_t triangle, std::uint32_t vertex) {
        const Triangle& t = result.triangles[triangle];
        return 3 * triangle + static_cast<std::uint32_t>(std::find(t.begin(), t.end(), vertex) - t.begin());
    };
    const surface::EdgeTable table = surface::edge_table(result);
    for (std::size_t e = 0; e < table.edges.size(); ++e) {
        const auto on_edge = table.corners[e];
        if (on_edge.size() != 2) continue;
        for (const std::uint32_t vertex : table.edges[e])
            corners.join(corner_at(on_edge[0] / 3, vertex), corner_at(on_edge[1] / 3, vertex));
    }
    std::map<std::uint32_t, std::uint32_t> number;  // new vertices by the representative corner of their set
    const std::vector<Vec3> vertices = std::move(result.vertices);
    result.vertices.clear();
    for (std::uint32_t c = 0; c < 3 * result.triangles.size(); ++c) {
        std::uint32_t& vertex = result.triangles[c / 3][c % 3];
        const auto [place, fresh] =
            number.try_emplace(corners.root(c), static_cast<std::uint32_t>(result.vertices.size()));
        if (fresh) result.vertices.push_back(vertices[vertex]);
        vertex = place->second;
    }
    return result;
}

}  // namespace sidewall::app
