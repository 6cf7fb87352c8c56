#include "app/pictures/render_scene.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "surface/error.hpp"
#include "surface/topology.hpp"

namespace sidewall::app {
namespace {

std::vector<int> triangle_materials(const TriangleMesh& mesh) {
    std::vector<int> ids(mesh.triangles.size(), -1);
    const Attribute* material = mesh.triangle_attribute("material");
    if (material && material->components == 1)
        for (std::size_t t = 0; t < ids.size(); ++t)
            if (std::abs(material->values[t]) < 1e6)
                ids[t] = static_cast<int>(std::lround(material->values[t]));
    return ids;
}

/// Values of an attribute; vectors by their length.
std::vector<double> magnitudes(const Attribute& attribute) {
    const auto n = static_cast<std::size_t>(attribute.components);
    if (n == 1) return attribute.values;
    std::vector<double> result(attribute.values.size() / n);
    for (std::size_t i = 0; i < result.size(); ++i)
        result[i] =
            Eigen::Map<const Eigen::VectorXd>(attribute.values.data() + i * n, attribute.components).norm();
    return result;
}

std::string unit_of(const std::string& name, const surface::MeshMetadata& metadata) {
    std::string length = metadata_text(metadata, "length_unit", "");
    if (length == "um") length = "\u00b5m";
    const std::string time = metadata_text(metadata, "time_unit", "");
    if (length.empty()) return "";
    if (name == "height" || name.starts_with("distance")) return length;
    if ((name.starts_with("rate") || name == "velocity" || name == "speed") && !time.empty())
        return fmt::format("{}/{}", length, time);
    return "";
}

/// Lowest and highest value but for half a percent at either end; NaN is passed over.
std::array<double, 2> usual_range(std::vector<double> values) {
    std::erase_if(values, [](double v) { return !std::isfinite(v); });
    if (values.empty()) return {0.0, 1.0};
    std::sort(values.begin(), values.end());
    const std::size_t margin = values.size() / 200;
    const double low = values[margin], high = values[values.size() - 1 - margin];
    // A scale that nearly reaches zero had better start there.
    return {low > 0.0 && low < 0.1 * high ? 0.0 : low, high};
}

/// Per corner, the sum of the normals around its vertex that lie within 40 degrees of its own triangle's.
std::vector<std::array<Eigen::Vector3f, 3>> crease_normals(const TriangleMesh& mesh) {
    const surface::Rows around = surface::vertex_corners(mesh);
    const double crease = std::cos(40.0 * std::numbers::pi / 180.0);
    const std::vector<Vec3> unit = triangle_normals(mesh);
    std::vector<std::array<Eigen::Vector3f, 3>> normals(mesh.triangles.size());
    tbb::parallel_for(std::size_t{0}, normals.size(), [&](std::size_t t) {
        for (std::size_t k = 0; k < 3; ++k) {
            Vec3 sum = Vec3::Zero();
            for (const std::uint32_t corner : around[mesh.triangles[t][k]])
                if (unit[corner / 3].dot(unit[t]) >= crease) sum += area_vector(mesh, corner / 3);
            normals[t][k] = (sum.isZero(0.0) ? unit[t] : sum.normalized()).cast<float>();
        }
    });
    return normals;
}

}  // namespace

Colouring choose_colouring(const Result& result, const std::string& name,
                           const std::optional<std::array<double, 2>>& range) {
    const TriangleMesh& mesh = result.surface;
    Colouring colouring;
    if (name == "material" || (name.empty() && mesh.triangle_attribute("material"))) {
        if (!mesh.triangle_attribute("material"))
            throw RecipeError(
                fmt::format("--color material: {} carries no material", result.source.string()));
        return colouring;
    }
    if (name.empty()) return colouring;
    // `flux` alone stands for the first species' flux.
    const auto matches = [&](const Attribute& a) { return a.name == name || a.name.starts_with(name + "_"); };
    const Attribute* chosen = mesh.vertex_attribute(name);
    colouring.per_vertex = chosen != nullptr;
    if (!chosen) chosen = mesh.triangle_attribute(name);
    for (const bool per_vertex : {false, true})
        for (const Attribute& a : per_vertex ? mesh.vertex_attributes : mesh.triangle_attributes)
            if (!chosen && matches(a)) {
                chosen = &a;
                colouring.per_vertex = per_vertex;
            }
    if (chosen) {
        colouring.values = magnitudes(*chosen);
    } else if (name == "height") {
        colouring.per_vertex = true;
        for (const Vec3& p : mesh.vertices) colouring.values.push_back(p.z());
    } else {
        std::string known = "height";
        for (const auto* attributes : {&mesh.triangle_attributes, &mesh.vertex_attributes})
            for (const Attribute& a : *attributes) known += ", " + a.name;
        throw RecipeError(fmt::format("--color {}: {} has no such attribute; choose one of: {}", name,
                                      result.source.string(), known));
    }
    colouring.scalar = true;
    const std::string shown = chosen ? chosen->name : name, unit = unit_of(shown, result.metadata);
    colouring.title = unit.empty() ? shown : fmt::format("{} ({})", shown, unit);
    const auto [low, high] = range.value_or(usual_range(colouring.values));
    colouring.low = low;
    colouring.high = high;
    return colouring;
}

RenderScene::RenderScene(const Result& result, Colouring colouring)
    : colouring_(std::move(colouring)), materials_(materials_of(result.metadata)) {
    for (const TriangleMesh& mesh : result.interfaces)
        layers_.push_back({&mesh, surface::RayScene(mesh), triangle_materials(mesh)});
    layers_.push_back(
        {&result.surface, surface::RayScene(result.surface), triangle_materials(result.surface)});
    const surface::Topology topology = surface::analyse_topology(result.surface);
    solid_ = topology.closed() || surface::boundary_on_rectangle(result.surface, topology);
    normals_ = crease_normals(result.surface);
}

Colour RenderScene::material_colour(int id) const {
    if (id >= 0 && static_cast<std::size_t>(id) < materials_.size())
        return colour_from_hex(materials_[static_cast<std::size_t>(id)].colour);
    return colour_from_hex("#aab4c0");
}

Colour RenderScene::surface_colour(const surface::SurfaceHit& hit) const {
    if (!colouring_.scalar) return material_colour(top().material[hit.triangle]);
    double value = 0.0;
    if (colouring_.per_vertex) {
        const auto [a, b, c] = top().mesh->triangles[hit.triangle];
        value = (1.0 - hit.u - hit.v) * colouring_.values[a] + hit.u * colouring_.values[b] +
                hit.v * colouring_.values[c];
    } else {
        value = colouring_.values[hit.triangle];
    }
    const double span = colouring_.high - colouring_.low;
    return viridis(span > 0.0 ? (value - colouring_.low) / span : value - value + 0.5);
}

Vec3 RenderScene::surface_normal(const surface::SurfaceHit& hit) const {
    const auto& [a, b, c] = normals_[hit.triangle];
    const Vec3 normal =
        (1.0 - hit.u - hit.v) * a.cast<double>() + hit.u * b.cast<double>() + hit.v * c.cast<double>();
    return normal.normalized();
}

std::optional<Colour> RenderScene::inside_colour(const Vec3& point) const {
    if (!solid_) return std::nullopt;
    // Straight up out of the material the first surface is met from behind. Layers wrap each other: the
    // lowest that holds the point is its material.
    const auto roof = [&](const RenderLayer& layer) {
        const auto hit = layer.scene.closest_hit(point, Vec3::UnitZ(), 0.0, 1e30);
        return hit && area_vector(*layer.mesh, hit.triangle).z() > 0.0 ? hit : surface::SurfaceHit{};
    };
    if (!roof(top())) return std::nullopt;
    for (const RenderLayer& layer : layers_)
        if (const auto hit = roof(layer)) return material_colour(layer.material[hit.triangle]);
    return std::nullopt;
}

std::vector<LegendEntry> RenderScene::legend() const {
    std::set<int> ids;
    for (const RenderLayer& layer : layers_) ids.insert(layer.material.begin(), layer.material.end());
    std::vector<LegendEntry> entries;
    for (const int id : ids)
        if (id >= 0)
            entries.push_back({static_cast<std::size_t>(id) < materials_.size()
                                   ? materials_[static_cast<std::size_t>(id)].name
                                   : fmt::format("material {}", id),
                               material_colour(id)});
    return entries;
}

}  // namespace sidewall::app
