#include "app/results/figure_values.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "app/recipe/recipe_domain.hpp"
#include "app/results/metrology.hpp"
#include "levelset/meshes/extract.hpp"
#include "levelset/meshes/volume.hpp"

namespace sidewall::app {
namespace {

double widest(const Stretches& stretches) {
    double most = kNone;
    for (const auto& [from, to] : stretches)
        if (std::isfinite(to - from)) most = std::fmax(most, to - from);
    return most;
}

double total(const Stretches& stretches) {
    double sum = 0.0;
    for (const auto& [from, to] : stretches) sum += to - from;
    return std::isfinite(sum) ? sum : kNone;
}

// Thickness of the interval that ends within `touching` of a wall; 0 if the wall is of another material.
double behind(const Stretches& stretches, double wall, bool left, double touching) {
    for (const auto& [from, to] : stretches)
        if (std::abs((left ? to : from) - wall) <= touching) return to - from;
    return 0.0;
}

double on_walls(WaferCut& cuts, int material, double z) {
    const auto [left, right] = widest_opening(cuts.open(), z);
    if (!std::isfinite(right - left)) return kNone;
    const Stretches own = cuts.of_material(material, [&](const Profile& p) { return solid_at(p, z); });
    const double touching = levelset::thinnest_film(cuts.stack().domain);
    const double sum = behind(own, left, true, touching) + behind(own, right, false, touching);
    return std::isfinite(sum) ? 0.5 * sum : kNone;
}

// Half the difference of two openings: that where the material bounds it on both sides (the median over the
// heights, as the boundary is slanted beside corners of its neighbours) and the narrowest one. The floor, up
// to the height where the walls become 80 degrees steep, does not count.
double recess(WaferCut& cuts, int material) {
    const double dx = cuts.stack().domain.spacing, touching = levelset::thinnest_film(cuts.stack().domain);
    const ProfileSpan span = span_of_profile(cuts.open());
    const double low = span.floor, high = span.crest;
    std::vector<double> widths;
    double narrowest = kNone, below = 0.0;
    bool floor = true;
    if (!(high > low)) return kNone;
    const int count = wall_samples(high - low, dx);
    for (int k = 0; k < count; ++k) {
        const double z = low + (k + 0.5) * (high - low) / count;
        const auto [left, right] = widest_opening(cuts.open(), z);
        if (!std::isfinite(right - left)) continue;
        constexpr double kSteep = 5.67;  // tan(80 degrees)
        floor = floor && right - left - below > 2.0 * (high - low) / count / kSteep;
        below = right - left;
        if (floor) continue;
        const Stretches own = cuts.of_material(material, [&](const Profile& p) { return solid_at(p, z); });
        const bool both =
            behind(own, left, true, touching) > 0.0 && behind(own, right, false, touching) > 0.0;
        if (both) widths.push_back(right - left);
        narrowest = std::fmin(narrowest, right - left);
    }
    if (widths.empty()) return kNone;
    std::sort(widths.begin(), widths.end());
    return 0.5 * (0.5 * (widths[(widths.size() - 1) / 2] + widths[widths.size() / 2]) - narrowest);
}

double volume(const levelset::MaterialStack& stack, int material) {
    const std::vector<double> volumes = layer_volumes(stack);
    double sum = 0.0;
    for (std::size_t k = 0; k < volumes.size(); ++k)
        if (stack.layers[k].material == material) sum += volumes[k];
    return sum;
}

double variance(const std::vector<double>& values) {
    const auto n = static_cast<double>(values.size());
    double mean = 0.0, sum = 0.0;
    for (const double v : values) mean += v / n;
    for (const double v : values) sum += (v - mean) * (v - mean);
    return sum / (n - 1.0);
}

// Three standard deviations, along the line, of an opening's width or of the place of its edges (root mean
// square of both). The opening is the one that is widest in the recipe's cut.
double roughness(const Recipe& recipe, bool of_width, double z, const levelset::MaterialStack& stack,
                 const TriangleMesh& surface) {
    surface::Plane plane = surface::parse_plane(recipe.metrology.cut);
    const int across = plane.normal.x() != 0.0 ? 0 : 1;
    const auto a = static_cast<std::size_t>(across);
    const levelset::Domain& domain = stack.domain;
    const std::pair<double, double> line = widest_opening(profile_of(surface, plane, domain), z);
    std::vector<double> left, right, width;
    for (int row = 0; row < domain.cells[a]; ++row) {
        const double at = domain.min[a] + (row + 0.5) * domain.spacing;
        plane.offset = at * plane.normal[across];
        const auto [from, to] = opening_over(profile_of(surface, plane, domain), z, line);
        if (!std::isfinite(to - from)) continue;
        left.push_back(from);
        right.push_back(to);
        width.push_back(to - from);
    }
    if (width.size() < 2) return kNone;
    return 3.0 * std::sqrt(of_width ? variance(width) : 0.5 * (variance(left) + variance(right)));
}

// Length of a void along an axis: that of the union of its parts, into which periodic sides may have cut it.
double length_along(const std::vector<Box3>& boxes, int axis) {
    Stretches parts;
    for (const Box3& box : boxes) parts.emplace_back(box.min[axis], box.max[axis]);
    std::sort(parts.begin(), parts.end());
    double length = 0.0, reached = -kInfinity;
    for (const auto& [from, to] : parts) {
        length += std::max(0.0, to - std::max(from, reached));
        reached = std::max(reached, to);
    }
    return length;
}

// Whether a void ends at one of an axis's reflective sides and so goes on in its mirror image. If it touches
// both sides, it is as long as the domain and has none.
bool is_mirrored(const std::vector<Box3>& boxes, int axis, const levelset::Domain& domain) {
    const auto a = static_cast<std::size_t>(axis);
    if (domain.side[a] != levelset::Side::reflective) return false;
    const double near = 1e-6 * domain.spacing;
    const auto at = [&](auto&& touches) { return std::any_of(boxes.begin(), boxes.end(), touches); };
    return at([&](const Box3& box) { return box.min[axis] <= domain.min[a] + near; }) !=
           at([&](const Box3& box) { return box.max[axis] >= domain.max[a] - near; });
}

}  // namespace

const std::vector<levelset::SurfacePiece>& WaferCut::pieces() {
    if (!pieces_) pieces_ = levelset::surface_pieces(surface_, stack_);
    return *pieces_;
}

const TriangleMesh& WaferCut::open_surface() {
    if (!open_surface_) open_surface_ = app::open_surface(surface_, pieces(), stack_.domain);
    return *open_surface_ ? **open_surface_ : surface_;
}

const Profile& WaferCut::open() {
    if (!open_) open_ = profile_of(open_surface(), plane_, stack_.domain);
    return *open_;
}

const Profile& WaferCut::layer(std::size_t k) {
    layers_.resize(stack_.layers.size());
    if (!layers_[k])
        layers_[k] =
            profile_of(k + 1 < layers_.size() ? levelset::extract_around(stack_, k, plane_) : surface_,
                       plane_, stack_.domain);
    return *layers_[k];
}

const Profile& WaferCut::open_below() {
    const std::size_t below = stack_.layers.size() - 2;
    if (layer(below).lines.size() <= 1) return layer(below);  // a void's walls would be a line of their own
    if (!open_below_) {
        TriangleMesh mesh = levelset::extract_surface(stack_, below);
        if (auto open = app::open_surface(mesh, levelset::surface_pieces(mesh, stack_.domain), stack_.domain))
            mesh = std::move(*open);
        open_below_ = profile_of(mesh, plane_, stack_.domain);
    }
    return *open_below_;
}

Stretches WaferCut::of_material(int material, const std::function<Stretches(const Profile&)>& solid) {
    Stretches all;
    for (std::size_t k = 0; k < stack_.layers.size(); ++k) {
        if (stack_.layers[k].material != material) continue;
        const Stretches own = k == 0 ? solid(layer(0)) : without(solid(layer(k)), solid(layer(k - 1)));
        all.insert(all.end(), own.begin(), own.end());
    }
    std::sort(all.begin(), all.end());
    // Intervals of touching layers of one material are joined.
    const double touching = levelset::thinnest_film(stack_.domain);
    Stretches joined;
    for (const auto& [from, to] : all)
        if (!joined.empty() && from <= joined.back().second + touching)
            joined.back().second = std::max(joined.back().second, to);
        else
            joined.emplace_back(from, to);
    return joined;
}

double figure_value(const Recipe& recipe, const Figure& figure, WaferCut& cut) {
    const auto level = [&](const Profile& p) { return solid_at(p, -figure.at); };
    switch (figure.kind) {
        case FigureKind::opening:
            return opening(cut.open(), -figure.at);
        case FigureKind::without:  // measured on another wafer by measure()
            break;
        case FigureKind::width:
            return widest(cut.of_material(figure.material, level));
        case FigureKind::thickness: {
            const Vec3 axis = surface::plane_axes(cut.plane())[0];
            const double along = figure.at * (axis.x() + axis.y());
            return total(
                cut.of_material(figure.material, [&](const Profile& p) { return solid_below(p, along); }));
        }
        case FigureKind::wall:
            return on_walls(cut, figure.material, -figure.at);
        case FigureKind::recess:
            return recess(cut, figure.material);
        case FigureKind::ler:
        case FigureKind::lwr:
            return roughness(recipe, figure.kind == FigureKind::lwr, -figure.at, cut.stack(),
                             cut.open_surface());
        case FigureKind::volume:
            return volume(cut.stack(), figure.material) / volume_divisor(recipe);
    }
    return kNone;
}

Voids voids_in(const TriangleMesh& surface, const std::vector<levelset::SurfacePiece>& pieces,
               const levelset::Domain& domain, const Vec3& along) {
    Voids voids;
    const int across = std::abs(along.x()) > 0.5 ? 0 : 1;
    const double cell = std::pow(domain.spacing, 3);
    for (const levelset::SurfacePiece& piece : pieces) {
        if (piece.cover != 0 || -piece.volume < cell) continue;
        ++voids.count;
        voids.volume -= piece.volume;
        const std::array mirrored{is_mirrored(piece.boxes, 0, domain), is_mirrored(piece.boxes, 1, domain)};
        const double images = (mirrored[0] ? 2.0 : 1.0) * (mirrored[1] ? 2.0 : 1.0);
        voids.whole_volume -= piece.volume * (domain.axial ? 1.0 : images);
        voids.top = std::fmax(voids.top, surface.vertices[piece.top].z());
        const double once = length_along(piece.boxes, across);
        voids.width = std::fmax(voids.width, mirrored[static_cast<std::size_t>(across)] ? 2.0 * once : once);
    }
    return voids;
}

std::optional<TriangleMesh> open_surface(const TriangleMesh& surface,
                                         const std::vector<levelset::SurfacePiece>& pieces,
                                         const levelset::Domain& domain) {
    const auto sealed = levelset::sealed_off(surface, pieces, domain);
    if (sealed.empty()) return std::nullopt;
    TriangleMesh open;
    open.vertices = surface.vertices;
    for (std::size_t t = 0; t < sealed.size(); ++t)
        if (sealed[t] == 0) open.triangles.push_back(surface.triangles[t]);
    return open;
}

}  // namespace sidewall::app
