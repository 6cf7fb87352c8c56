#include "app/devices/plane.hpp"

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

namespace sidewall::app {
namespace {

using Edge = std::array<std::uint32_t, 2>;

// The edges of all boundaries but the two sides across y.
std::map<Edge, int> named_edges(const TetMesh& mesh) {
    std::map<Edge, int> edges;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const std::string& name = mesh.boundaries[static_cast<std::size_t>(mesh.boundary[t])];
        if (name == "y-min" || name == "y-max") continue;
        for (std::size_t k = 0; k < 3; ++k) {
            const auto [a, b] = std::minmax(mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]);
            edges[{a, b}] = mesh.boundary[t];
        }
    }
    return edges;
}

// The region behind a face of vertices that are \p marked, by its corners in order.
std::map<Triangle, int> regions_behind(const TetMesh& mesh, const std::vector<std::uint8_t>& marked) {
    std::map<Triangle, int> regions;
    for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
        for (std::size_t out = 0; out < 4; ++out) {
            Triangle face{};
            for (std::size_t k = 0, n = 0; k < 4; ++k)
                if (k != out) face[n++] = mesh.tetrahedra[t][k];
            if (std::ranges::any_of(face, [&](std::uint32_t v) { return marked[v] == 0; })) continue;
            std::sort(face.begin(), face.end());
            regions[face] = mesh.region[t];
        }
    return regions;
}

}  // namespace

PlaneMesh plane_of(const TetMesh& mesh) {
    PlaneMesh plane;
    plane.regions = mesh.regions;
    const auto is_side = [&](std::size_t t) {
        return mesh.boundaries[static_cast<std::size_t>(mesh.boundary[t])] == "y-min";
    };
    std::vector<std::uint8_t> on_side(mesh.vertices.size(), 0);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        if (is_side(t))
            for (const std::uint32_t v : mesh.triangles[t]) on_side[v] = 1;
    const std::map<Triangle, int> behind = regions_behind(mesh, on_side);
    const std::map<Edge, int> named = named_edges(mesh);
    std::map<std::uint32_t, std::uint32_t> numbers;
    std::map<Edge, int> used;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (!is_side(t)) continue;
        Triangle sorted = mesh.triangles[t], corners{};
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t v = sorted[k];
            const auto [place, is_new] =
                numbers.try_emplace(v, static_cast<std::uint32_t>(plane.vertices.size()));
            if (is_new) plane.vertices.emplace_back(mesh.vertices[v].x(), mesh.vertices[v].z(), 0.0);
            corners[k] = place->second;
            const auto [a, b] = std::minmax(v, mesh.triangles[t][(k + 1) % 3]);
            if (const auto edge = named.find({a, b}); edge != named.end()) used.insert(*edge);
        }
        std::sort(sorted.begin(), sorted.end());
        plane.triangles.push_back(corners);
        plane.region.push_back(behind.at(sorted));
    }
    std::map<int, int> kept;  // of the boundaries
    for (const auto& [edge, boundary] : used) {
        const auto [place, is_new] = kept.try_emplace(boundary, static_cast<int>(plane.boundaries.size()));
        if (is_new) plane.boundaries.push_back(mesh.boundaries[static_cast<std::size_t>(boundary)]);
        plane.edges.push_back({numbers.at(edge[0]), numbers.at(edge[1])});
        plane.boundary.push_back(place->second);
    }
    return plane;
}

}  // namespace sidewall::app
