#include "app/process/endpoint.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <utility>

#include "app/process/arriving/line_of_sight.hpp"
#include "app/process/estimate/blanket.hpp"
#include "app/recipe/figure_names.hpp"
#include "app/results/metrology.hpp"
#include "levelset/layers/layer_depths.hpp"
#include "levelset/layers/levels.hpp"
#include "levelset/meshes/extract.hpp"
#include "levelset/meshes/face_points.hpp"
#include "surface/ray_scene.hpp"

namespace sidewall::app {
namespace {

constexpr double kFloorRise = 0.7071;  // least cosine between a floor's normal and the vertical: 45 degrees
constexpr double kMaskSpeed = 0.5;     // most speed of a mask, as a share of the fastest material's

bool lies_flat(const TriangleMesh& mesh, std::size_t t) {
    const Vec3 area = area_vector(mesh, t);
    return area.z() > kFloorRise * area.norm();
}

// By vertex: whether it is the foot of a wall, from which a triangle steeper than 45 degrees rises.
std::vector<std::uint8_t> feet_of_walls(const TriangleMesh& mesh, double spacing) {
    constexpr double kRises = 0.05;  // in cells; least height of that triangle above the vertex
    std::vector<std::uint8_t> feet(mesh.vertices.size(), 0);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (lies_flat(mesh, t)) continue;
        const auto& [a, b, c] = mesh.triangles[t];
        const auto height = [&](std::uint32_t v) { return mesh.vertices[v].z(); };
        const double highest = std::max({height(a), height(b), height(c)});
        for (const std::uint32_t v : {a, b, c})
            if (height(v) < highest - kRises * spacing) feet[v] = 1;
    }
    return feet;
}

// Area of a triangle in the top view; 0 if it faces down or an overhang hides it.
double area_from_above(const TriangleMesh& mesh, std::size_t t, const ColumnSight& sight) {
    const double area = area_vector(mesh, t).z();
    return area > 0.0 && sight.open_above(triangle_centroid(mesh, t)) ? area : 0.0;
}

// What is found at a surface point: the bare material, and the thickness that covers the material asked for.
struct Place {
    int bare = -1;
    std::size_t layer = 0;  // the one that is bare
    double cover = kInfinity;
};

class Covers {
  public:
    Covers(const levelset::MaterialStack& stack, int material)
        : stack_(stack), material_(material), depth_(stack.layers.size() - 1) {
        for (const levelset::MaterialStack* level = &stack; level != nullptr; level = level->coarser.get())
            depths_.emplace_back(*level);
    }

    Place at(const Vec3& point) {
        const levelset::MaterialStack& counts = levelset::level_at(stack_, point);
        const auto coarser =
            static_cast<std::size_t>(levelset::level_count(stack_) - levelset::level_count(counts));
        const double touching = levelset::thinnest_film(counts.domain);
        depths_[coarser].at(counts.domain.to_index(point), depth_);
        Place place;
        for (std::size_t k = 0; k < stack_.layers.size(); ++k) {
            const double here = k < depth_.size() ? static_cast<double>(depth_[k]) : 0.0;
            if (stack_.layers[k].material == material_)
                place.cover = std::min(place.cover, here <= touching ? 0.0 : here - 0.5 * touching);
            if (here > touching) continue;
            place.bare = stack_.layers[k].material;
            place.layer = k;
            break;  // layer k is exposed, so those above have ended
        }
        return place;
    }

  private:
    const levelset::MaterialStack& stack_;
    int material_;
    std::vector<levelset::LayerDepths> depths_;  // by grid level
    std::vector<float> depth_;
};

// What lies below points of the surface, found on the fronts of the layers, each made on first use.
class LayersBelow {
  public:
    explicit LayersBelow(const levelset::MaterialStack& stack) : stack_(stack) {}

    // Whether a material lies anywhere below a point. The substrate's material does everywhere.
    bool has(int material, const Vec3& point) {
        if (stack_.layers.front().material == material) return true;
        for (std::size_t k = 1; k < stack_.layers.size(); ++k) {
            if (stack_.layers[k].material != material) continue;
            const double top = depth(k, point);
            if (std::isfinite(top) && depth(k - 1, point) - top > resolved()) return true;
        }
        return false;
    }

    // Whether a film lies on a mask: whether, straight below a point of the film, a mask comes before the
    // material.
    // \param layer  the film's
    bool on_mask(std::size_t layer, const Vec3& point, int material, const std::vector<int>& masks) {
        return mask_first(layer, material, masks, [&](std::size_t k) { return depth(k, point); });
    }
    // Whether a mask, such as one beside the film, is nearer to a point of the film than the material is.
    bool nearer_to_mask(std::size_t layer, const Vec3& point, int material, const std::vector<int>& masks) {
        return mask_first(layer, material, masks, [&](std::size_t k) { return distance(k, point); });
    }

  private:
    double resolved() const { return levelset::kExposed * stack_.domain.spacing; }

    // \param to  gives the distance to the front of a layer.
    template <class Distance>
    bool mask_first(std::size_t layer, int material, const std::vector<int>& masks,
                    const Distance& to) const {
        const auto is_mask = [&](std::size_t k) {
            return std::ranges::count(masks, stack_.layers[k].material) > 0;
        };
        std::size_t lowest = 1;
        while (lowest < layer && !is_mask(lowest)) ++lowest;
        for (std::size_t k = layer; k-- > lowest;) {
            const bool mask = is_mask(k);
            if ((mask || stack_.layers[k].material == material) && to(k - 1) - to(k) > resolved())
                return mask;
        }
        return false;
    }

    const std::optional<surface::RayScene>& front(std::size_t k) {
        const auto [at, fresh] = fronts_.try_emplace(k);
        const TriangleMesh mesh = fresh ? levelset::extract_surface(stack_, k) : TriangleMesh();
        if (!mesh.triangles.empty()) at->second.emplace(mesh);
        return at->second;
    }
    double depth(std::size_t k, const Vec3& point) {
        const Vec3 from = point + Vec3(0.0, 0.0, 0.01 * stack_.domain.spacing);
        const auto& scene = front(k);
        const auto hit = scene ? scene->closest_hit(from, -Vec3::UnitZ(), 0.0, 1e30) : surface::RayHit();
        return hit ? hit.distance : kInfinity;
    }
    double distance(std::size_t k, const Vec3& point) {
        const auto& scene = front(k);
        const auto hit =
            scene ? scene->closest_point(point, 1e30, stack_.domain.period()) : surface::SurfaceHit();
        return hit ? hit.distance : kInfinity;
    }

    const levelset::MaterialStack& stack_;
    std::map<std::size_t, std::optional<surface::RayScene>> fronts_;  // by layer; nothing if it has no front
};

}  // namespace

BareFloor bare_floor(const levelset::MaterialStack& stack, const TriangleMesh& surface, int material,
                     const std::vector<int>& masks, double asked) {
    Covers covers(stack, material);
    LayersBelow below(stack);
    const ColumnSight sight(surface, stack.domain.spacing);
    // Pairs of the thickness that covers the material, and an area. At a wall's foot, the extracted surface
    // cuts the corner off: a cover thinner than kCutOff counts only where there is no other floor, and so
    // does a film nearer to a mask, as on its walls.
    constexpr double kCutOff = 0.6;  // in cells
    std::vector<std::pair<double, double>> floor, beside_walls;
    double bare = 0.0;
    bool any = false;
    const levelset::FacePoints faces(surface);
    const std::vector<std::uint8_t> feet = feet_of_walls(surface, stack.domain.spacing);
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
        // On a round wafer a triangle of the profile stands for a ring, whose area goes as its radius.
        const double ring = stack.domain.axial ? triangle_centroid(surface, t).x() : 1.0,
                     area = ring * area_from_above(surface, t, sight);
        if (area <= 0.0) continue;
        const Vec3 point = faces.of(t);
        const Place place = covers.at(point);
        if (place.bare != material &&
            (!lies_flat(surface, t) || std::count(masks.begin(), masks.end(), place.bare) > 0 ||
             !below.has(material, point) || below.on_mask(place.layer, point, material, masks)))
            continue;
        const bool is_bare = place.bare == material;
        const bool beside = (!is_bare && below.nearer_to_mask(place.layer, point, material, masks)) ||
                            (place.cover < kCutOff * stack.domain.spacing &&
                             std::ranges::any_of(surface.triangles[t], [&](auto v) { return feet[v] != 0; }));
        any = any || !beside;
        (is_bare || !beside ? floor : beside_walls).emplace_back(is_bare ? 0.0 : place.cover, area);
        if (is_bare) bare += area;
    }
    if (!any) std::ranges::move(beside_walls, std::back_inserter(floor));
    double whole = 0.0;
    for (const auto& [cover, area] : floor) whole += area;
    if (whole <= 0.0) return {};
    std::sort(floor.begin(), floor.end());
    BareFloor result{bare / whole};
    double sum = 0.0;
    for (const auto& [cover, area] : floor)
        if ((sum += area) > asked * whole) {
            result.left = cover;
            break;
        }
    return result;
}

std::optional<double> bare_share(const Recipe& recipe, const Step& step, const RunState& state,
                                 const TriangleMesh& surface) {
    const std::optional<StopRule> rule = bare_rule(recipe, step);
    if (!rule) return std::nullopt;
    return bare_floor(state.stack, surface, rule->bare, state.endpoint.masks.value_or(std::vector<int>()),
                      rule->value)
        .share;
}

void note_masks(const Recipe& recipe, const Step& step, const Model& model, const TriangleMesh& surface,
                RunState& state) {
    std::vector<int>& masks = state.endpoint.masks.emplace();
    const std::optional<StopRule> rule = bare_rule(recipe, step);
    if (!rule) return;
    const levelset::MaterialStack& stack = state.stack;
    Step by_law = step;
    by_law.built = std::make_shared<const Model>(model);
    const std::vector<BlanketRate> rates = blanket_rates({"", &by_law, layer_materials(stack)});  // by layer
    Covers covers(stack, rule->bare);
    LayersBelow below(stack);
    const ColumnSight sight(surface, stack.domain.spacing);
    const levelset::FacePoints faces(surface);
    std::vector<Vec3> floor;
    double fastest = 0.0;
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
        if (!lies_flat(surface, t) || area_from_above(surface, t, sight) <= 0.0) continue;
        const Vec3 point = faces.of(t);
        const Place place = covers.at(point);
        if (place.bare != rule->bare) fastest = std::max(fastest, -rates[place.layer].rate);
        if (below.has(rule->bare, point)) floor.push_back(point);
    }
    std::vector<Vec3> open = floor;  // where no mask has been found
    for (std::size_t k = rates.size(); k-- > 1;) {
        const auto& [material, rate, unknown] = rates[k];
        const bool slow = unknown.empty() && std::max(0.0, -rate) < kMaskSpeed * fastest;
        const auto lacks = [&, it = material](const Vec3& point) { return !below.has(it, point); };
        if (material == rule->bare || !slow || std::ranges::all_of(floor, lacks) ||
            std::ranges::none_of(open, lacks))
            continue;
        masks.push_back(material);
        std::erase_if(open, std::not_fn(lacks));
    }
}

void note_endpoint(const Recipe& recipe, const Step& step, const char* key, const TriangleMesh& surface,
                   RunState& state) {
    state.endpoint.time = state.time;
    state.endpoint.key = key;
    state.endpoint.bare = bare_share(recipe, step, state, surface);
}

double step_end(const Step& step, const RunState& state) {
    const double longest = state.step_start + step.duration;
    const std::optional<double>& came = state.endpoint.time;
    if (!came) return longest;
    return std::min(longest, *came + step.over_etch * (*came - state.step_start) + step.over_etch_time);
}

StepEnd end_of(const Recipe& recipe, const Step& step, const RunState& state, const TriangleMesh& surface) {
    StepEnd end;
    end.duration = state.time - state.step_start;
    end.stopped_by = kDuration;
    end.time = state.process_time();
    end.measures = measure(recipe, state.stack, surface);
    end.noise = state.noise;
    if (!step.built) return end;
    end.bare = bare_share(recipe, step, state, surface);
    end.has_stop = has_stop(step);
    const RunEndpoint& endpoint = state.endpoint;
    if (!endpoint.time) return end;
    end.endpoint = state.epoch + *endpoint.time;
    end.endpoint_bare = endpoint.bare;
    end.over_etch = state.time - *endpoint.time;
    const double wanted = step.over_etch * (*endpoint.time - state.step_start) + step.over_etch_time;
    const double rounding = 1e-9 * wanted + 4.0 * std::numeric_limits<double>::epsilon() * state.time;
    if (end.over_etch >= wanted - rounding) end.stopped_by = endpoint.key;
    return end;
}

std::string end_line(const Recipe& recipe, const Step& step, const RunState& state, const StepEnd& end) {
    if (!end.has_stop) return {};
    const std::string& unit = recipe.domain.time_unit;
    const auto share = [&](const std::optional<double>& bare) {
        const std::optional<StopRule> rule = bare_rule(recipe, step);
        return bare && rule ? fmt::format(", {:.1f} % of {} bare under the openings", 100.0 * *bare,
                                          recipe.materials[static_cast<std::size_t>(rule->bare)].name)
                            : std::string();
    };
    std::string line = fmt::format("{:.6g} {}, step {}: ", end.time, unit, step.name);
    if (!end.endpoint)
        return line + fmt::format("ended by its duration, before its stop condition held{}", share(end.bare));
    line += fmt::format("endpoint ({}) after {:.4g} {}{}", state.endpoint.key, end.duration - end.over_etch,
                        unit, share(end.endpoint_bare));
    if (end.over_etch > 0.0)
        line += fmt::format("; over-etched for {:.4g} {}{}{}", end.over_etch, unit,
                            end.stopped_by == kDuration ? ", until the step's duration was over" : "",
                            share(end.bare));
    return line;
}

}  // namespace sidewall::app
