#include "app/process/arriving/surface_field.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <numbers>

#include "app/common/json.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

// Where a wedge's value is sampled, as a share of the way from its vertex to the middle of its fan. At a
// vertex on a crease the closest point could lie on either side. A tenth costs at most a tenth of the value's
// change over the fan.
constexpr double kInside = 0.1;

// A sampling point inside each wedge's fan.
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

// Values of a name, by corner; null if the field lacks it.
const std::vector<double>* corners_of(const SurfaceField& field, const std::string& name) {
    const auto found = std::find(field.names.begin(), field.names.end(), name);
    return found == field.names.end() ? nullptr
                                      : &field.corner[static_cast<std::size_t>(found - field.names.begin())];
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
    return Json(Json::binary_t(std::move(bytes)));  // Json::binary crashes when memory runs out
}

template <class T>
std::vector<T> values_of(const Json& json) {
    const auto& bytes = json.get_binary();
    if (bytes.size() % sizeof(T) != 0) throw FileError("its coverages are cut off");
    std::vector<T> values(bytes.size() / sizeof(T));
    if (!bytes.empty()) std::memcpy(static_cast<void*>(values.data()), bytes.data(), bytes.size());
    return values;
}

// Fluxes and coverages by wedge in the order of carried_names, without direct fluxes.
std::vector<std::vector<double>> carried_values(const SurfaceFlux& arriving) {
    std::vector<std::vector<double>> values = arriving.flux;
    for (const DirectPart& part : arriving.direct)
        std::ranges::copy(part.rest, values.begin() + static_cast<std::ptrdiff_t>(part.tally));
    values.insert(values.end(), arriving.coverage.begin(), arriving.coverage.end());
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
                                       std::span<const Vec3> points, const flux::LateralBox& box) {
    std::vector<std::vector<double>> result(names.size(), std::vector<double>(points.size(), 0.0));
    std::vector<const std::vector<double>*> source(names.size(), nullptr);
    bool known = false;
    for (std::size_t k = 0; k < names.size(); ++k) {
        source[k] = corners_of(field, names[k]);
        known = known || source[k] != nullptr;
    }
    if (!known || !field.scene) return result;
    // For speed only: most points are on a surface that has moved by less than a cell, so a short search
    // radius skips most of the hierarchy. If that finds nothing, the search is repeated without a bound.
    const double reach = 1e-2 * diagonal(field.scene->vertices());
    tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t w) {
        surface::SurfaceHit hit = field.scene->closest_point(points[w], reach, box.period);
        if (!hit) hit = field.scene->closest_point(points[w], 1e30, box.period);
        const std::size_t c = 3 * std::size_t{hit.triangle};
        for (std::size_t k = 0; k < names.size(); ++k)
            if (source[k] != nullptr)
                result[k][w] = (1.0 - hit.u - hit.v) * (*source[k])[c] + hit.u * (*source[k])[c + 1] +
                               hit.v * (*source[k])[c + 2];
    });
    return result;
}

std::vector<std::vector<double>> carry(const SurfaceField& field, const std::vector<std::string>& names,
                                       const TriangleMesh& mesh, const flux::Wedges& wedges,
                                       const flux::LateralBox& box) {
    return carry(field, names, inner_points(mesh, wedges), box);
}

std::vector<std::vector<double>> kept_or_carried(const SurfaceField& field,
                                                 const std::vector<std::string>& names,
                                                 const TriangleMesh& mesh, const flux::Wedges& wedges,
                                                 const flux::LateralBox& box) {
    if (!field.scene || !std::ranges::equal(field.scene->triangles(), mesh.triangles) ||
        !std::ranges::equal(field.scene->vertices(), mesh.vertices))
        return carry(field, names, mesh, wedges, box);
    std::vector<std::vector<double>> kept(names.size(), std::vector<double>(wedges.count(), 0.0));
    for (std::size_t k = 0; k < names.size(); ++k) {
        const std::vector<double>* corner = corners_of(field, names[k]);
        for (std::size_t c = 0; corner != nullptr && c < corner->size(); ++c)
            kept[k][wedges.corner[c]] = (*corner)[c];
    }
    return kept;
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

bool bounds_by_flux(const SimplifySection& section) {
    return section.flux_change > 0.0 && (section.method == "auto" || section.method == "region-bounded");
}

std::vector<double> flux_gradient(const TriangleMesh& mesh, const SurfaceFlux& arriving) {
    // Standard errors of a difference that count as noise. Noise exceeds three on only one edge in 370.
    constexpr double kNoise = 3.0;
    const flux::Wedges& wedges = arriving.wedges;
    std::vector<double> gradient(wedges.count(), 0.0);
    for (std::size_t tally = 0; tally < arriving.flux.size(); ++tally) {
        const std::vector<double>& flux = arriving.flux[tally];
        const std::vector<double>& error = arriving.trace->error[tally];
        for (std::size_t c = 0; c < wedges.corner.size(); ++c) {
            const std::size_t next = c % 3 == 2 ? c - 2 : c + 1;
            const std::uint32_t v = wedges.corner[c], w = wedges.corner[next];
            const double change = std::abs(flux[v] - flux[w]) - kNoise * std::hypot(error[v], error[w]);
            const double length = (mesh.vertices[mesh.triangles[c / 3][c % 3]] -
                                   mesh.vertices[mesh.triangles[next / 3][next % 3]])
                                      .norm();
            if (!(change > 0.0) || !(length > 0.0)) continue;
            const double steep = change / (0.5 * (std::abs(flux[v]) + std::abs(flux[w])) * length);
            gradient[v] = std::max(gradient[v], steep);
            gradient[w] = std::max(gradient[w], steep);
        }
    }
    return gradient;
}

std::vector<std::string> carried_names(const Model& model) {
    std::vector<std::string> names;
    for (const std::string& name : flux_names(model.species)) names.push_back("flux_" + name);
    names.insert(names.end(), model.coverages.names.begin(), model.coverages.names.end());
    return names;
}

SurfaceField flux_field(const Model& model, const TracedSurface& surface) {
    const SurfaceFlux& arriving = *surface.arriving;
    return surface_field(surface.traced(), arriving.wedges, carried_names(model), carried_values(arriving),
                         surface.scene);
}

SurfaceFlux carried_fluxes(const Model& model, const SurfaceField& field, const TriangleMesh& mesh,
                           const flux::LateralBox& box, SurfaceFlux parts) {
    std::vector<std::vector<double>> values = carry(field, carried_names(model), mesh, parts.wedges, box);
    const auto first_coverage = values.end() - static_cast<std::ptrdiff_t>(model.coverages.names.size());
    parts.coverage.assign(std::make_move_iterator(first_coverage), std::make_move_iterator(values.end()));
    parts.flux.assign(std::make_move_iterator(values.begin()), std::make_move_iterator(first_coverage));
    return parts;
}

namespace {

// Fluxes of an earlier surface and of this one by wedge, both sampled slightly inside the wedges.
struct FluxesOfTwo {
    std::vector<std::vector<double>> before, now;
};

FluxesOfTwo before_and_now(const Model& model, const SurfaceField& before, const TracedSurface& surface) {
    const auto sampled = [&](const SurfaceField& from) {
        return carry(from, carried_names(model), surface.traced(), surface.arriving->wedges, surface.box);
    };
    return {sampled(before), sampled(flux_field(model, surface))};
}

}  // namespace

TracedSurface with_later_fluxes(const Model& model, const SurfaceField& before, const TracedSurface& surface,
                                double share) {
    constexpr double kMostChange = 1.0 / 3.0;
    TracedSurface later = surface;
    SurfaceFlux& arriving = *later.arriving;
    const FluxesOfTwo fluxes = before_and_now(model, before, surface);
    const auto go_on = [&](std::vector<double>& flux, std::size_t tally) {
        for (std::size_t w = 0; w < flux.size(); ++w) {
            const double now = fluxes.now[tally][w], change = now - fluxes.before[tally][w];
            if (std::abs(change) < kMostChange * now) flux[w] = std::max(0.0, flux[w] + share * change);
        }
    };
    for (std::size_t tally = 0; tally < arriving.flux.size(); ++tally) go_on(arriving.flux[tally], tally);
    for (DirectPart& part : arriving.direct)
        for (std::size_t k = 0; k < part.rest.size(); ++k) go_on(part.rest[k], part.tally + k);
    return later;
}

SurfaceField field_to_carry(const Recipe& recipe, const Model& model, const TracedSurface& surface,
                            const std::vector<std::vector<double>>& coverage) {
    const SurfaceFlux& arriving = *surface.arriving;
    const bool fluxes = !model.coverages.transient;
    std::vector<std::string> names = fluxes ? carried_names(model) : model.coverages.names;
    std::vector<std::vector<double>> values = fluxes ? carried_values(arriving) : coverage;
    if (surface.simplified && bounds_by_flux(recipe.simplify)) {
        names.emplace_back(kFluxGradient);
        values.push_back(flux_gradient(surface.traced(), arriving));
    }
    return surface_field(surface.traced(), arriving.wedges, names, values, surface.scene);
}

double flux_change(const Model& model, const SurfaceField& field, const TracedSurface& surface) {
    const SurfaceFlux& arriving = *surface.arriving;
    const auto [before, now] = before_and_now(model, field, surface);
    double most = 0.0;
    for (std::size_t tally = 0; tally < arriving.flux.size(); ++tally) {
        double difference = 0.0, noise = 0.0, sum = 0.0;
        for (std::size_t w = 0; w < arriving.wedges.count(); ++w) {
            const double area = arriving.wedges.area[w];
            difference += area * std::abs(now[tally][w] - before[tally][w]);
            noise += area * arriving.trace->error[tally][w];
            sum += area * std::abs(now[tally][w]);
        }
        // The mean difference of two normal errors of width sigma is 2 sigma / sqrt(pi).
        noise *= 2.0 / std::sqrt(std::numbers::pi);
        const double change = std::sqrt(std::max(0.0, difference * difference - noise * noise));
        if (sum > 0.0) most = std::max(most, change / sum);
    }
    return most;
}

std::uint32_t time_steps_within(double tolerance, double change, std::uint32_t since) {
    // Extrapolates the change linearly from the few time steps over which it was measured. Tracing at least
    // every eighth time step forgoes at most an eighth of the possible gain, and bounds the error of the
    // extrapolation.
    constexpr double kMost = 8.0;
    if (since == 0) return 0;
    const double steps = change > 0.0 ? tolerance / change * since : kMost;
    return static_cast<std::uint32_t>(std::min(kMost, steps));
}

FluxReuse next_reuse(double tolerance, const Model& model, const FluxReuse& reuse, const SurfaceField* before,
                     const TracedSurface& surface) {
    if (surface.arriving && !surface.arriving->trace) return {reuse.left - 1, reuse.since + 1};
    if (!surface.arriving || before == nullptr || tolerance == 0.0) return {0, 1};
    const std::uint32_t more =
        time_steps_within(tolerance, flux_change(model, *before, surface), reuse.since);
    return {more > 0 ? more - 1 : 0, 1};
}

}  // namespace sidewall::app
