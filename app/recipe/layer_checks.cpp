#include "app/recipe/layer_checks.hpp"

#include <fmt/format.h>

#include <numbers>

#include "levelset/shapes/mesh_body.hpp"

namespace sidewall::app {
namespace {

// Extent of a shape along one axis of the domain.
struct Reach {
    bool covers = false;      // the shape spans the whole domain
    bool misses = false;      // the shape lies outside the domain
    double width = 0.0;       // width of the shape, mirror images at the sides included
    double rest = kInfinity;  // distance to its next image
};

Reach reach_of(double low, double high, const levelset::Domain& domain, std::size_t axis) {
    const double min = domain.min[axis], max = domain.max[axis], length = max - min;
    const double tiny = kRounding * length;
    Reach reach{.width = high - low};
    if (domain.side[axis] == levelset::Side::periodic) {
        reach.covers = high - low >= length - tiny;
        reach.rest = length - (high - low);
        return reach;
    }
    reach.covers = low <= min + tiny && high >= max - tiny;
    reach.misses = high <= min + tiny || low >= max - tiny;
    // A side mirrors the part of a shape that crosses it, or the space between it and a shape that does not.
    for (const double inside : {high - min, max - low}) reach.width = std::min(reach.width, 2.0 * inside);
    for (const double beside : {low - min, max - high})
        if (beside > tiny) reach.rest = std::min(reach.rest, 2.0 * beside);
    return reach;
}

// Horizontal and vertical size of a shape with walls.
struct Walls {
    const char* key = "width";  // key that sets the width
    // Half-widths along x and y at the flat surface; 0 along an axis where it is endless.
    std::array<double, 2> half{};
    double length = 0.0;  // along z
    bool recess = true;
    bool round = false;
    const char* noun() const { return recess ? "opening" : "shape"; }
    const char* itself() const { return recess ? "the opening" : "the shape"; }
    const char* beside() const {
        return recess ? "what stands beside the opening" : "the gap beside the shape";
    }
};

std::optional<Walls> walls_of(const Layer& layer, double thickness) {
    const bool cut = layer.subtract;
    const double r = layer.radius, along = 0.5 * layer.length.value_or(0.0),
                 across = 0.5 * layer.span.value_or(0.0);
    if (layer.shape == "trench" || layer.shape == "hole") {
        const double length = std::min(layer.depth.value_or(kInfinity), thickness);
        if (layer.shape == "trench") return Walls{"width", {0.5 * layer.width, 0.0}, length};
        return Walls{"radius", {r, r}, length, true, true};
    }
    if (layer.shape == "fin") return Walls{"width", {0.5 * layer.width, 0.0}, layer.height, cut};
    if (layer.shape == "box")
        return Walls{"size", {0.5 * layer.size[0], 0.5 * layer.size[1]}, layer.height, cut};
    if (layer.shape == "sphere") return Walls{"radius", {r, r}, 2.0 * r, cut, true};
    if (layer.shape == "cylinder" && layer.axis == "z")
        return Walls{"radius", {r, r}, 2.0 * along, cut, true};
    if (layer.shape == "cylinder") {
        const char* key = along > 0.0 && along < r ? "length" : "radius";
        return layer.axis == "x" ? Walls{key, {along, r}, 2.0 * r, cut}
                                 : Walls{key, {r, along}, 2.0 * r, cut};
    }
    if (layer.shape == "gap")
        return Walls{across > 0.0 && (along == 0.0 || across < along) ? "width" : "length",
                     {along, across},
                     layer.height,
                     cut};
    return std::nullopt;
}

// Extents along x and y of the shape widened by \p lean on every side.
std::array<Reach, 2> reaches(const Layer& layer, const Walls& walls, double lean,
                             const levelset::Domain& domain) {
    std::array<Reach, 2> reach;
    for (std::size_t axis = 0; axis < 2; ++axis) {
        if (walls.half[axis] == 0.0) {
            reach[axis].covers = true;  // endless along this axis
            reach[axis].width = kInfinity;
            continue;
        }
        const double half = walls.half[axis] + lean;
        reach[axis] = reach_of(layer.position[axis] - half, layer.position[axis] + half, domain, axis);
    }
    return reach;
}

// Whether the shape, widened by \p lean on every side, covers the whole domain.
bool covers(const Layer& layer, const Walls& walls, double lean, const levelset::Domain& domain) {
    const std::array<Reach, 2> reach = reaches(layer, walls, lean, domain);
    if (!walls.round) return reach[0].covers && reach[1].covers;
    // A circle covers the domain if it contains the corner farthest from its centre.
    std::array<double, 2> farthest{};
    for (std::size_t axis = 0; axis < 2; ++axis)
        farthest[axis] = domain.side[axis] == levelset::Side::periodic
                             ? 0.5 * (domain.max[axis] - domain.min[axis])
                             : std::max(std::abs(domain.max[axis] - layer.position[axis]),
                                        std::abs(domain.min[axis] - layer.position[axis]));
    return std::hypot(farthest[0], farthest[1]) <= walls.half[0] + lean;
}

void check_place(const Layer& layer, const Walls& walls, const levelset::Domain& domain) {
    const std::array<Reach, 2> reach = reaches(layer, walls, 0.0, domain);
    const std::string size =
        fmt::format("{:g} x {:g}", domain.max[0] - domain.min[0], domain.max[1] - domain.min[1]);
    if (covers(layer, walls, 0.0, domain))
        raise_key(walls.key,
                  "the {} covers the whole domain, {}: only the wafer's height "
                  "would change; use a smaller one or a larger domain.extent",
                  walls.noun(), size);
    if (reach[0].misses || reach[1].misses)
        raise_key("position", "the {} lies outside the domain, {}; move it inside", walls.noun(),
                  domain.axial ? fmt::format("r from 0 to {:g}", domain.max[0]) : size + " and centred on 0");
}

// Tapered walls must neither meet nor reach their neighbours before the shape's end.
void check_taper(const Layer& layer, const Walls& walls, const levelset::Domain& domain) {
    if (!std::isfinite(walls.length) || walls.length <= 0.0 || layer.taper_deg == 0.0) return;
    const double degree = std::numbers::pi / 180.0, slope = std::tan(layer.taper_deg * degree);
    double half = walls.half[0];
    if (walls.half[1] > 0.0) half = std::min(half, walls.half[1]);
    constexpr double kSharp = 1e-3;  // relative tolerance for walls that are meant to meet exactly at the end
    const char* extent = layer.shape == "trench" || layer.shape == "hole" ? "depth" : "height";
    if (slope * walls.length > (1.0 + kSharp) * half)
        raise_key("taper_deg",
                  "the walls meet at a {0} of {1:.4g}, before the {2:.4g} asked for: use a "
                  "taper of at most {3:.4g} degrees, or a {0} of at most {1:.4g}",
                  extent, half / slope, walls.length, std::atan(half / walls.length) / degree);
    if (slope < 0.0 && covers(layer, walls, -slope * walls.length, domain))
        raise_key("taper_deg",
                  "the walls lean out so far that the {} covers the whole domain "
                  "at its {}; use a smaller taper or a larger domain.extent",
                  walls.noun(), walls.recess ? "bottom" : "top");
}

void check_width(const Layer& layer, const Walls& walls, const levelset::Domain& domain,
                 const std::string& path, std::vector<std::string>& notes) {
    const double dx = domain.spacing, least = kFewestCells * dx * (1.0 - kRounding);
    double width = kInfinity, rest = width;
    for (const Reach& reach : reaches(layer, walls, 0.0, domain)) {
        if (reach.covers) continue;  // no edge along this axis
        width = std::min(width, reach.width);
        rest = std::min(rest, reach.rest);
    }
    const bool beside = rest < width;
    const double narrowest = std::min(width, rest);
    const std::string what =
        fmt::format("{} is {:.3g} cells wide", beside ? walls.beside() : walls.itself(), narrowest / dx);
    const std::string finer = fmt::format("use a grid_spacing of {:.2g} or less", narrowest / kGoodCells);
    if (narrowest < least)
        raise_key(walls.key, "{}, and the grid loses shapes under {:g} cells: {}", what, kFewestCells, finer);
    if (narrowest < kGoodCells * dx * (1.0 - kRounding))
        notes.push_back(fmt::format("{}.{}: {}: under {:g} its corners and fluxes are coarse; {}", path,
                                    walls.key, what, kGoodCells, finer));
}

// Checks the height of shapes placed by their centre, which may be lower than they are wide.
void check_thickness(const Layer& layer, const Walls& walls, const levelset::Domain& domain,
                     const std::string& path, std::vector<std::string>& notes) {
    if (!layer.z) return;
    const char* key = layer.shape == "gap"                             ? "height"
                      : layer.axis == "z" && layer.shape == "cylinder" ? "length"
                                                                       : "radius";
    const double cells = walls.length / domain.spacing * (1.0 + kRounding);
    const std::string finer = fmt::format("use a grid_spacing of {:.2g} or less", walls.length / kGoodCells);
    if (cells < kFewestCells)
        raise_key(key,
                  "the {} is only {:.3g} cells high, and the grid loses shapes under {:g} "
                  "cells: {}",
                  layer.shape, cells, kFewestCells, finer);
    if (cells < kGoodCells)
        notes.push_back(fmt::format(
            "{}.{}: the {} is {:.3g} cells high: under {:g} its corners and fluxes are coarse; {}", path, key,
            layer.shape, cells, kGoodCells, finer));
}

// Notes that a layer is thin: it keeps its thickness only until it is undercut.
void note_thin(double thickness, const levelset::Domain& domain, const std::string& path,
               std::vector<std::string>& notes) {
    const double cells = thickness / domain.spacing * (1.0 + kRounding);
    if (!(cells > 0.0) || cells >= kFewestCells) return;
    notes.push_back(fmt::format(
        "{}: the layer is {:.3g} cells thick: where it is undercut, a layer under {:g} cells becomes up to "
        "half a cell thinner or thicker, or vanishes; to keep it, use a grid_spacing of {:.2g} or less",
        path, cells, kFewestCells, thickness / kFewestCells));
}

// make_body.cpp rounds a box by offsetting a smaller box, which must exist.
void check_edges(const Layer& layer) {
    if (layer.shape != "box" || layer.radius == 0.0) return;
    const double angle = layer.taper_deg * std::numbers::pi / 180.0, sine = std::abs(std::sin(angle));
    const double narrowest =
        0.5 * std::min(layer.size[0], layer.size[1]) - std::max(0.0, std::tan(angle)) * layer.height;
    const double most = std::min(narrowest * std::cos(angle) / (1.0 + sine * sine),
                                 layer.height / (layer.subtract ? 2.0 : 1.0));
    if (layer.radius >= most)
        raise_key("radius", "the edges are rounder than the box is wide or high; use less than {:.4g}", most);
}

// Checks that a mesh lies within \p most of z = 0 and meets the domain.
void check_mesh_place(const Box3& bounds, const levelset::Domain& domain, double most) {
    if (std::max(std::abs(bounds.min.z()), std::abs(bounds.max.z())) > most)
        raise_key("file",
                  "reaches from z = {:g} to {:g}, beyond +-{:g}; check its unit, or use "
                  "a larger grid_spacing",
                  bounds.min.z(), bounds.max.z(), most);
    for (std::size_t axis = 0; axis < 2; ++axis) {
        const auto a = static_cast<Eigen::Index>(axis);
        if (bounds.max[a] <= domain.min[axis] || bounds.min[a] >= domain.max[axis])
            raise_key("file",
                      "the mesh lies from {} = {:g} to {:g}, outside the domain's {:g} to "
                      "{:g}; check its unit and place",
                      "xy"[axis], bounds.min[a], bounds.max[a], domain.min[axis], domain.max[axis]);
    }
}

}  // namespace

void check_shape(const Layer& layer, double thickness, const levelset::Domain& domain,
                 const std::string& path, std::vector<std::string>& notes) {
    note_thin(thickness, domain, path, notes);
    std::optional<Walls> walls = walls_of(layer, thickness);
    if (!walls) return;
    if (domain.axial) walls->half[1] = 0.0, walls->round = false;  // as seen in the plane of r and z
    check_place(layer, *walls, domain);
    check_taper(layer, *walls, domain);
    check_width(layer, *walls, domain, path, notes);
    check_thickness(layer, *walls, domain, path, notes);
    check_edges(layer);
}

void check_mesh(const Layer& layer, const levelset::Domain& domain, double most, const std::string& path,
                std::vector<std::string>& notes) {
    try {
        const levelset::ImportedMesh imported = levelset::import_mesh(layer.file, domain);
        check_mesh_place(imported.bounds, domain, most);
        if (const std::string words = surface::repair_summary(imported.repairs); !words.empty())
            notes.push_back(fmt::format("{}.file: {}", path, words));
        if (imported.over > 0)
            notes.push_back(
                fmt::format("{}.file: {} of its bodies cross periodic sides, and continue at the opposite "
                            "ones",
                            path, imported.over));
    } catch (const GeometryError& error) {
        throw KeyError("file", error.what());
    }
}

}  // namespace sidewall::app
