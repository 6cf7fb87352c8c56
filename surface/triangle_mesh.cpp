#include "surface/triangle_mesh.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>

namespace sidewall {
namespace {

const Attribute* find(const std::vector<Attribute>& attributes, std::string_view name) {
    const auto it = std::ranges::find(attributes, name, &Attribute::name);
    return it == attributes.end() ? nullptr : &*it;
}

}  // namespace

void take_elements(Attribute& attribute, std::span<const std::uint32_t> elements) {
    const auto n = static_cast<std::size_t>(attribute.components);
    std::vector<double> values;
    values.reserve(n * elements.size());
    for (const std::size_t e : elements)
        for (std::size_t k = 0; k < n; ++k) values.push_back(attribute.values[n * e + k]);
    attribute.values = std::move(values);
}

const Attribute* TriangleMesh::vertex_attribute(std::string_view name) const {
    return find(vertex_attributes, name);
}

const Attribute* TriangleMesh::triangle_attribute(std::string_view name) const {
    return find(triangle_attributes, name);
}

bool overlap(const Box3& a, const Box3& b) {
    return (a.min.array() <= b.max.array()).all() && (b.min.array() <= a.max.array()).all();
}

Box3 bounding_box(const TriangleMesh& mesh) {
    return tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, mesh.vertices.size(), 16384), Box3{},
        [&](const auto& range, Box3 box) {
            for (std::size_t v = range.begin(); v != range.end(); ++v) box.extend(mesh.vertices[v]);
            return box;
        },
        [](Box3 a, const Box3& b) {
            a.extend(b);
            return a;
        });
}

Vec3 area_vector(const TriangleMesh& mesh, std::size_t triangle) {
    const auto [a, b, c] = mesh.triangles[triangle];
    return (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
}

double triangle_area(const TriangleMesh& mesh, std::size_t triangle) {
    return 0.5 * area_vector(mesh, triangle).norm();
}

Vec3 triangle_centroid(const TriangleMesh& mesh, std::size_t triangle) {
    const auto [a, b, c] = mesh.triangles[triangle];
    return (mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c]) / 3.0;
}

std::vector<Vec3> triangle_normals(const TriangleMesh& mesh) {
    std::vector<Vec3> normals(mesh.triangles.size());
    for (std::size_t t = 0; t < normals.size(); ++t) normals[t] = area_vector(mesh, t).normalized();
    return normals;
}

double total_area(const TriangleMesh& mesh) {
    double sum = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) sum += triangle_area(mesh, t);
    return sum;
}

double enclosed_volume(const TriangleMesh& mesh) {
    double sum = 0.0;
    for (const auto& [a, b, c] : mesh.triangles)
        sum += mesh.vertices[a].dot(mesh.vertices[b].cross(mesh.vertices[c]));
    return sum / 6.0;
}

}  // namespace sidewall
