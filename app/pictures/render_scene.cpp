#include "app/pictures/render_scene.hpp"

#include <fmt/format.h>

#include <tbb/parallel_for.h>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "surface/topology.hpp"

namespace sidewall::app {
namespace {

constexpr double kThinnest = 0.02;  // in cells: thinner layers count as none

Colour material_colour(int id, const Materials& materials) {
    return colour_from_hex(material_of(id, materials).colour);
}

/// Values of an attribute; lengths of its vectors if it has several components.
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

/// Normals at triangle corners: area-weighted over triangles around the vertex within 40 degrees of this one.
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

/// Material between surface and interface below: the most frequent on the surface where the two differ.
std::optional<int> uppermost(const TriangleMesh& surface, const std::vector<int>& material,
                             const surface::RayScene* below, double thin) {
    std::vector<std::uint8_t> apart(material.size(), 1);
    if (below)
        tbb::parallel_for(std::size_t{0}, apart.size(), [&](std::size_t t) {
            apart[t] = !below->closest_point(triangle_centroid(surface, t), thin);
        });
    std::map<int, std::size_t> count;
    for (std::size_t t = 0; t < apart.size(); ++t) count[material[t]] += apart[t];
    if (!below && count.size() > 1) return std::nullopt;
    const auto [most, number] =
        *std::ranges::max_element(count, {}, &std::pair<const int, std::size_t>::second);
    return number > 0 ? std::optional(most) : std::nullopt;
}

double thin_layer(const Result& result) {
    if (result.interfaces.empty()) return 0.0;
    double thin = kThinnest * cell_size(result.surface);
    for (const TriangleMesh& mesh : result.interfaces) thin = std::min(thin, kThinnest * cell_size(mesh));
    return thin;
}

// Half an outline's width, in diameters of a sample's disc.
constexpr double kOutline = 1.7;

// Largest share of a film's thickness under half an outline: its two outlines leave at least half of it.
constexpr double kOfFilm = 0.25;

/// A layer's boundary within a disc of the section, taken as straight.
struct Front {
    double distance = 0.0;  ///< negative inside
    double slope = 1.0;     ///< change of the distance per length in the section
    double outline = 0.0;   ///< half of its outline's largest width
    Colour colour = Colour::Zero();

    /// Share of a disc that lies inside.
    double share(double width) const { return std::clamp(0.5 - distance / (slope * width), 0.0, 1.0); }

    /// Share of a disc that lies within \p half of the boundary.
    double line(double width, double half) const {
        const double at = std::abs(distance) / slope;
        const double covered = std::min(at + 0.5 * width, half) - std::max(at - 0.5 * width, -half);
        return std::clamp(covered / width, 0.0, 1.0);
    }
};

Front front_of(const surface::DistanceSample& sample, int axis, double outline, const Colour& colour) {
    // Least slope: at() divides by it, and a front parallel to the section has the slope 0.
    constexpr double kLeastSlope = 1e-3;
    const double slope = std::sqrt(std::max(0.0, 1.0 - sample.rise[axis] * sample.rise[axis]));
    return {sample.distance, std::max(slope, kLeastSlope), outline, colour};
}

}  // namespace

Material material_of(int id, const Materials& materials) {
    const auto index = static_cast<std::size_t>(id);
    return index < materials.size() ? materials[index]
                                    : Material{.name = fmt::format("material {}", id), .colour = "#aab4c0"};
}

std::vector<int> triangle_materials(const TriangleMesh& mesh) {
    std::vector<int> ids(mesh.triangles.size(), -1);
    const Attribute* material = mesh.triangle_attribute("material");
    if (material && material->components == 1)
        for (std::size_t t = 0; t < ids.size(); ++t)
            if (std::abs(material->values[t]) < 1e6)
                ids[t] = static_cast<int>(std::lround(material->values[t]));
    return ids;
}

std::array<double, 2> usual_range(std::vector<double> values) {
    std::erase_if(values, [](double v) { return !std::isfinite(v); });
    if (values.empty()) return {0.0, 1.0};
    std::sort(values.begin(), values.end());
    const std::size_t margin = values.size() / 200;
    const double low = values[margin], high = values[values.size() - 1 - margin];
    // A scale that nearly reaches zero starts there.
    return {low > 0.0 && low < 0.1 * high ? 0.0 : low, high};
}

double cell_size(const TriangleMesh& mesh) {
    return std::sqrt(2.0 * total_area(mesh) / static_cast<double>(mesh.triangles.size()));
}

std::optional<int> uppermost_material(const Result& result) {
    std::optional<surface::RayScene> below;
    if (!result.interfaces.empty()) below.emplace(result.interfaces.back());
    return uppermost(result.surface, triangle_materials(result.surface), below ? &*below : nullptr,
                     thin_layer(result));
}

std::optional<Colouring> find_colouring(const Result& result, const std::string& name,
                                        const std::optional<std::array<double, 2>>& range) {
    const TriangleMesh& mesh = result.surface;
    Colouring colouring;
    const bool has_material = mesh.triangle_attribute("material") != nullptr;
    if (name == "material" && !has_material) return std::nullopt;
    if (name == "material" || name.empty()) return colouring;
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
        return std::nullopt;
    }
    colouring.scalar = true;
    colouring.attribute = chosen ? chosen->name : name;
    const std::string unit = unit_of(colouring.attribute, result.metadata);
    colouring.title = unit.empty() ? colouring.attribute : fmt::format("{} ({})", colouring.attribute, unit);
    const auto [low, high] = range.value_or(usual_range(colouring.values));
    colouring.low = low;
    colouring.high = high;
    return colouring;
}

Colouring choose_colouring(const Result& result, const std::string& name,
                           const std::optional<std::array<double, 2>>& range) {
    if (auto found = find_colouring(result, name, range)) return *std::move(found);
    if (name == "material")
        throw RecipeError("--color material: {} carries no material", result.source.string());
    std::string known = "height";
    for (const auto* attributes : {&result.surface.triangle_attributes, &result.surface.vertex_attributes})
        for (const Attribute& a : *attributes) known += ", " + a.name;
    throw RecipeError("--color {}: {} has no such attribute; choose one of: {}", name, result.source.string(),
                      known);
}

std::set<int> materials_on(const Result& result) {
    std::set<int> ids;
    const auto add = [&](const TriangleMesh& mesh) {
        const std::vector<int> of = triangle_materials(mesh);
        ids.insert(of.begin(), of.end());
    };
    for (const TriangleMesh& mesh : result.interfaces) add(mesh);
    add(result.surface);
    return ids;
}

std::vector<LegendEntry> legend(const std::set<int>& ids, const Materials& materials) {
    std::vector<LegendEntry> entries;
    for (const int id : ids)
        if (id >= 0) entries.push_back({material_of(id, materials).name, material_colour(id, materials)});
    return entries;
}

RenderScene::RenderScene(const Result& result, Colouring colouring)
    : colouring_(std::move(colouring)), materials_(materials_of(result.metadata)) {
    const TriangleMesh& surface = result.surface;
    thin_ = thin_layer(result);
    for (const TriangleMesh& mesh : result.interfaces) {
        layers_.push_back({&mesh, surface::SignedDistance(mesh), triangle_materials(mesh), {}});
        layers_.back().body = layers_.back().material.front();
    }
    const surface::RayScene* below = layers_.empty() ? nullptr : &layers_.back().distance.scene();
    std::vector<int> material = triangle_materials(surface);
    const std::optional<int> body = uppermost(surface, material, below, thin_);
    layers_.push_back({&surface, surface::SignedDistance(surface), std::move(material), body});
    const surface::Topology topology = surface::analyse_topology(surface);
    solid_ = topology.closed() || surface::boundary_on_rectangle(surface, topology);
    normals_ = crease_normals(surface);
}

Colour RenderScene::surface_colour(const surface::SurfaceHit& hit) const {
    if (!colouring_.scalar) return material_colour(layers_.back().material[hit.triangle], materials_);
    double value = 0.0;
    if (colouring_.per_vertex) {
        const auto [a, b, c] = surface().triangles[hit.triangle];
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

Colour RenderScene::layer_colour(std::size_t layer, const surface::SurfaceHit& nearest) const {
    const RenderLayer& of = layers_[layer];
    return material_colour(of.body.value_or(of.material[nearest.triangle]), materials_);
}

SectionReader::SectionReader(const RenderScene& scene) : scene_(scene), last_(scene.layers().size()) {}

// Signed distance to a layer, exact where it is at most `exact`. It changes by no more than the distance
// moved: far from a front, the cached value bounds it and gives its sign.
surface::DistanceSample SectionReader::distance(std::size_t layer, const Vec3& point, double exact) {
    const RenderLayer& of = scene_.layers()[layer];
    std::optional<Last>& last = last_[layer];
    double radius = 1e30;
    if (last) {
        const double way = (point - last->point).norm(), known = std::abs(last->found.distance);
        if (of.body && known - way > exact) {
            surface::DistanceSample bound = last->found;
            bound.distance = std::copysign(known - way, last->found.distance);
            return bound;
        }
        radius = 1.000001 * (known + way);
    }
    last = Last{point, of.distance.at(point, radius)};
    surface::DistanceSample found = last->found;
    const double before = std::abs(found.distance);
    if (before > exact || scene_.thin() == 0.0) return found;
    // A sheet or a gap thinner than thin() counts as none: behind it the distance has the same sign as here.
    const Vec3 beyond = point - (found.distance + std::copysign(scene_.thin(), found.distance)) * found.rise;
    const double there = of.distance.at(beyond, 1.000001 * (2.0 * before + scene_.thin())).distance;
    if ((there > 0.0) == (found.distance > 0.0)) found.distance = std::copysign(2.0 * exact, found.distance);
    return found;
}

SectionSample SectionReader::at(const Vec3& point, int axis, double width) {
    const double outline = kOutline * width;
    // Up to here, distances must be exact for shares, outlines and film thicknesses.
    const double exact = 0.5 * width + outline + outline / kOfFilm + scene_.thin();
    const std::size_t top = scene_.layers().size() - 1;
    const surface::DistanceSample surface = distance(top, point, exact);
    SectionSample sample;
    if (surface.distance > 0.5 * width) return sample;
    std::optional<Front> lower;
    for (std::size_t k = 0; k <= top; ++k) {
        const surface::DistanceSample found = k == top ? surface : distance(k, point, exact);
        Front front = front_of(found, axis, outline, scene_.layer_colour(k, found.nearest));
        const double thickness = lower ? lower->distance - front.distance : 0.0;
        if (lower && thickness < scene_.thin()) continue;
        const double share = std::max(front.share(width), sample.solid);
        sample.colour += (share - sample.solid) * front.colour;
        sample.solid = share;
        if (lower && lower->colour != front.colour) {
            front.outline = std::min(outline, kOfFilm * thickness / front.slope);
            sample.line = std::max(sample.line, lower->line(width, std::min(lower->outline, front.outline)));
        }
        lower = front;
    }
    sample.line = std::max(sample.line, lower->line(width, lower->outline));
    if (sample.solid > 0.0) sample.colour /= sample.solid;
    if (surface.distance <= 0.0) sample.offset_to_outside = (0.01 * width - surface.distance) * surface.rise;
    return sample;
}

}  // namespace sidewall::app
