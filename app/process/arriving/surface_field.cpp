#include "app/process/arriving/surface_field.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "app/common/json.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

// How far from its vertex towards the middle of its fan a wedge looks for its value. On a crease's vertex
// itself the closest point could lie on either side; farther in, the value is that of a point beside the
// vertex: a tenth of the way costs at most a tenth of what the value changes by over the fan.
constexpr double kInside = 0.1;

// A point of each wedge that is surely its own.
std::vector<Vec3> inner_points(const TriangleMesh& mesh, const flux::Wedges& wedges) {
    std::vector<Vec3> sum(wedges.count(), Vec3::Zero());
    std::vector<double> weight(wedges.count(), 0.0);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Vec3 centroid = triangle_centroid(mesh, t);
        const double area = triangle_area(mesh, t);
        for (std::size_t k = 0; k < 3; ++k) {
            sum[wedges.corner[3 * t + k]] += area * centroid;
            weight[wedges.corner[3 * t + k]] += area;
        }
    }
    for (std::size_t v = 0; v + 1 < wedges.first.size(); ++v)
        for (std::uint32_t w = wedges.first[v]; w < wedges.first[v + 1]; ++w)
            sum[w] = weight[w] > 0.0 ? Vec3((1.0 - kInside) * mesh.vertices[v] + kInside / weight[w] * sum[w])
                                     : mesh.vertices[v];
    return sum;
}

std::shared_ptr<const surface::RayScene> scene_of(const TriangleMesh& mesh) {
    return mesh.triangles.empty() ? nullptr : std::make_shared<const surface::RayScene>(mesh);
}

double diagonal(std::span<const Vec3> vertices) {
    Vec3 low = vertices[0], high = vertices[0];
    for (const Vec3& p : vertices) {
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
    }
    return (high - low).norm();
}

template <class T>
Json blob(std::span<const T> values) {
    static_assert(std::is_trivially_copyable_v<T> || std::is_same_v<T, Vec3>);
    std::vector<std::uint8_t> bytes(values.size() * sizeof(T));
    if (!bytes.empty()) std::memcpy(bytes.data(), static_cast<const void*>(values.data()), bytes.size());
    return Json(Json::binary_t(std::move(bytes)));  // Json::binary crashes for want of memory
}

template <class T>
std::vector<T> values_of(const Json& json) {
    const auto& bytes = json.get_binary();
    if (bytes.size() % sizeof(T) != 0) throw FileError("its coverages are cut off");
    std::vector<T> values(bytes.size() / sizeof(T));
    if (!bytes.empty()) std::memcpy(static_cast<void*>(values.data()), bytes.data(), bytes.size());
    return values;
}

}  // namespace

SurfaceField surface_field(const TriangleMesh& mesh, const flux::Wedges& wedges,
                           const std::vector<std::string>& names,
                           const std::vector<std::vector<double>>& by_wedge,
                           std::shared_ptr<const surface::RayScene> scene) {
    SurfaceField field;
    if (names.empty()) return field;
    field.names = names;
    for (const std::vector<double>& values : by_wedge) {
        std::vector<double>& corner = field.corner.emplace_back(wedges.corner.size());
        for (std::size_t c = 0; c < corner.size(); ++c) corner[c] = values[wedges.corner[c]];
    }
    field.scene = scene ? std::move(scene) : scene_of(mesh);
    return field;
}

std::vector<std::vector<double>> carry(const SurfaceField& field, const std::vector<std::string>& names,
                                       std::span<const Vec3> points) {
    std::vector<std::vector<double>> result(names.size(), std::vector<double>(points.size(), 0.0));
    std::vector<const std::vector<double>*> source(names.size(), nullptr);
    bool known = false;
    for (std::size_t k = 0; k < names.size(); ++k) {
        const auto found = std::find(field.names.begin(), field.names.end(), names[k]);
        if (found == field.names.end()) continue;
        source[k] = &field.corner[static_cast<std::size_t>(found - field.names.begin())];
        known = true;
    }
    if (!known || !field.scene) return result;
    // Only for speed: the points are those of a surface that has moved by less than a cell, and a short reach
    // spares the search most of the hierarchy. What is farther is sought again without a bound.
    const double reach = 1e-2 * diagonal(field.scene->vertices());
    tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t w) {
        surface::SurfaceHit hit = field.scene->closest_point(points[w], reach);
        if (!hit) hit = field.scene->closest_point(points[w], 1e30);
        const std::size_t c = 3 * std::size_t{hit.triangle};
        for (std::size_t k = 0; k < names.size(); ++k)
            if (source[k] != nullptr)
                result[k][w] = (1.0 - hit.u - hit.v) * (*source[k])[c] + hit.u * (*source[k])[c + 1] +
                               hit.v * (*source[k])[c + 2];
    });
    return result;
}

std::vector<std::vector<double>> carry(const SurfaceField& field, const std::vector<std::string>& names,
                                       const TriangleMesh& mesh, const flux::Wedges& wedges) {
    return carry(field, names, inner_points(mesh, wedges));
}

Json to_json(const SurfaceField& field) {
    Json json{{"names", field.names},
              {"vertices", blob(field.scene ? field.scene->vertices() : std::span<const Vec3>())},
              {"triangles", blob(field.scene ? field.scene->triangles() : std::span<const Triangle>())},
              {"corner", Json::array()}};
    for (const std::vector<double>& values : field.corner)
        json["corner"].push_back(blob(std::span<const double>(values)));
    return json;
}

SurfaceField surface_field_from_json(const Json& json) {
    SurfaceField field;
    json.at("names").get_to(field.names);
    TriangleMesh mesh;
    mesh.vertices = values_of<Vec3>(json.at("vertices"));
    mesh.triangles = values_of<Triangle>(json.at("triangles"));
    for (const Json& values : json.at("corner")) field.corner.push_back(values_of<double>(values));
    bool good = field.corner.size() == field.names.size();
    for (const auto& values : field.corner) good = good && values.size() == 3 * mesh.triangles.size();
    for (const Triangle& triangle : mesh.triangles)
        for (const std::uint32_t v : triangle) good = good && v < mesh.vertices.size();
    if (!good) throw FileError("its coverages do not fit their surface");
    bool finite = true;
    for (const auto& values : field.corner)
        for (const double value : values) finite = finite && std::isfinite(value);
    for (const Vec3& vertex : mesh.vertices) finite = finite && vertex.allFinite();
    if (!finite) throw FileError("its coverages are not finite");
    field.scene = scene_of(mesh);
    return field;
}

}  // namespace sidewall::app
