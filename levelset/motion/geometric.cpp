#include "levelset/motion/geometric.hpp"

#include <openvdb/tree/LeafManager.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>

#include "levelset/grid.hpp"
#include "levelset/layers/cut_layers.hpp"
#include "levelset/meshes/pieces.hpp"
#include "levelset/openvdb_grid.hpp"
#include "levelset/redistance.hpp"
#include "levelset/shapes/outline.hpp"
#include "surface/error.hpp"
#include "surface/ray_scene.hpp"

namespace sidewall::levelset {
namespace {

using LeafManager = openvdb::tree::LeafManager<Grid::TreeType>;

// Combines level sets (union, intersection, difference) by combine(values) at every node near a front, and
// re-distances the result. Every point of its front lies on one of theirs, so that their bands hold its band.
template <std::size_t N, class Combine>
GridPtr combined(const Domain& domain, const std::array<const Grid*, N>& grids, Combine&& combine) {
    GridPtr result = grids[0]->deepCopy();
    for (std::size_t i = 1; i < N; ++i) result->tree().topologyUnion(grids[i]->tree());
    const float background = result->background();
    std::atomic<bool> changed{false};
    LeafManager leaves(result->tree());
    tbb::parallel_for(std::size_t{0}, leaves.leafCount(), [&](std::size_t n) {
        Leaf& leaf = leaves.leaf(n);
        std::array<const Leaf*, N> own;
        for (std::size_t i = 0; i < N; ++i)
            own[i] = grids[i]->getConstUnsafeAccessor().probeConstLeaf(leaf.origin());
        for (openvdb::Index k = 0; k < Leaf::SIZE; ++k) {
            std::array<float, N> value;
            for (std::size_t i = 0; i < N; ++i)
                value[i] = own[i]                                           ? own[i]->getValue(k)
                           : inside(*grids[i], leaf.offsetToGlobalCoord(k)) ? -background
                                                                            : background;
            const float v = combine(value);
            const bool on = leaf.isValueOn(k) && std::abs(v) < background;
            if (on && v != value[0]) changed = true;
            leaf.setValueOnly(k, on ? v : std::copysign(background, v));
            leaf.setActiveState(k, on);
        }
    });
    trim_band(*result, domain);
    // Without a change the grid is not re-distanced, so that edges stay sharp.
    if (changed && result->activeVoxelCount() > 0) redistance(*result, domain, kSweepsAnew, Start::distance);
    return result;
}

GridPtr united(const Domain& domain, const Grid& a, const Grid& b) {
    return combined(domain, std::array{&a, &b}, [](const auto& v) { return std::min(v[0], v[1]); });
}

GridPtr common(const Domain& domain, const Grid& a, const Grid& b) {
    return combined(domain, std::array{&a, &b}, [](const auto& v) { return std::max(v[0], v[1]); });
}

// Linear ramp: 1 up to \p from, 0 from \p to on.
float ramp(float x, float from, float to) {
    return std::clamp((to - x) / (to - from), 0.0f, 1.0f);
}

// The new level set of a layer \p own whose material stays when others below it go: the union of its film and
// \p bare, which the level set \p below it becomes (null: nothing is left there). The grid holds no gap
// thinner than a cell under a film, and none is wanted where nothing went: there the film closes the gap.
GridPtr without(const Domain& domain, const Grid& own, const Grid& below, const Grid* bare) {
    if (bare == nullptr)
        return combined(domain, std::array{&own, &below},
                        [](const auto& v) { return std::max(v[0], -v[1]); });
    const auto dx = static_cast<float>(domain.spacing), none = static_cast<float>(kExposed) * dx;
    return combined(domain, std::array{&own, &below, bare}, [dx, none](const auto& v) {
        const float gap = v[2] - v[1], no_film = ramp(v[1] - v[0], none, 0.5f * dx);
        const float film = std::max(v[0], -v[1]) + 2.0f * dx * no_film,
                    closed = dx * ramp(gap, 0.5f * dx, dx) * (1.0f - no_film);
        return std::max(v[0], std::min(film, v[2]) - closed);
    });
}

GridPtr plane(const Domain& domain, double height) {
    const double margin = 2.0 * kHalfWidth * domain.spacing;
    return sample_grid(
        domain, [height](const Vec3& p) { return p.z() - height; }, height - margin, height + margin);
}

// Moves the front outwards by \p thickness.
void grow(Grid& surface, const Domain& domain, double thickness) {
    const double most = 0.5 * domain.spacing;
    const int parts = static_cast<int>(std::ceil(thickness / most));
    const auto part = static_cast<float>(thickness / std::max(1, parts));
    const float limit = std::nextafter(surface.background(), 0.0f);
    for (int n = 0; n < parts; ++n) {
        LeafManager leaves(surface.tree());
        leaves.foreach ([&](Leaf& leaf, std::size_t) {
            for (auto it = leaf.beginValueOn(); it; ++it) it.setValue(std::clamp(*it - part, -limit, limit));
        });
        redistance(surface, domain, 3);
    }
}

double highest_front(const Grid& grid, const Domain& domain) {
    double highest = band_z_range(grid, domain)[0];  // throws if nothing is left
    for (const Vec3& p : extract_surface(grid, domain).vertices) highest = std::max(highest, p.z());
    return highest;
}

// Overlap, in dx, of walls that coincide with the wafer's, so that no film of zero thickness is left.
constexpr double kOverlap = 1e-3;

// Everything beside the openings of \p pattern or below \p bottom, up to above \p top. The openings are
// widened by \p wider (world units) on every side.
GridPtr columns(const MaterialStack& stack, const Shape& pattern, double bottom, double top, double wider) {
    const Domain& domain = stack.domain;
    const double margin = 2.0 * kHalfWidth * domain.spacing, end = top + margin;
    const double low =
        std::min(band_z_range(*stack.layers.front().phi, domain)[0], std::isfinite(bottom) ? bottom : end);
    const auto distance = [&, open = outline(pattern, domain)](const Vec3& p) {
        return std::max(p.z() - end, wider + std::min(-open(p.x(), p.y()), p.z() - bottom));
    };
    return sample_grid(domain, distance, low - margin, end + margin);
}

// Removes closed voids from \p film: gas nodes whose closest surface bounds a void, and material nodes within
// reach of such a surface, as its distances are needed however near the film is.
void keep_out_of_voids(Grid& film, const MaterialStack& stack) {
    const Domain& domain = stack.domain;
    const TriangleMesh surface = extract_surface(stack.top(), domain);
    const std::vector<SurfacePiece> pieces = surface_pieces(surface, domain);
    const std::vector<std::uint8_t> sealed = sealed_off(surface, pieces, domain);
    if (sealed.empty()) return;
    TriangleMesh voids;
    voids.vertices = surface.vertices;
    const double reach = kHalfWidth * domain.spacing;
    Box3 box;  // around all voids
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
        if (sealed[t] == 0) continue;
        voids.triangles.push_back(surface.triangles[t]);
        for (const std::uint32_t v : surface.triangles[t]) box.extend(surface.vertices[v]);
    }
    const surface::RayScene scene(surface), beside_voids(voids);
    box = {box.min - Vec3::Constant(reach), box.max + Vec3::Constant(reach)};
    const std::array<double, 2> period = domain.period();
    for (std::size_t axis = 0; axis < 2; ++axis) {
        double &low = box.min[static_cast<Eigen::Index>(axis)],
               &high = box.max[static_cast<Eigen::Index>(axis)];
        if (period[axis] > 0.0 && (low < domain.min[axis] || high > domain.max[axis]))
            low = domain.min[axis], high = domain.max[axis];
    }
    std::vector<std::pair<openvdb::Coord, float>>
        missing;  // leaves of the surface that the film lacks, and their value
    for (auto leaf = stack.top().tree().cbeginLeaf(); leaf; ++leaf)
        if (!film.tree().probeConstLeaf(leaf->origin()))
            missing.emplace_back(leaf->origin(),
                                 inside(film, leaf->origin()) ? -film.background() : film.background());
    for (const auto& [origin, side] : missing) film.tree().touchLeaf(origin)->fill(side, false);
    LeafManager leaves(film.tree());
    leaves.foreach ([&](Leaf& leaf, std::size_t) {
        for (openvdb::Index k = 0; k < Leaf::SIZE; ++k) {
            const openvdb::Coord c = leaf.offsetToGlobalCoord(k);
            const Vec3 p(domain.coordinate(0, c.x()), domain.coordinate(1, c.y()),
                         domain.coordinate(2, c.z()));
            if ((p.array() < box.min.array()).any() || (p.array() > box.max.array()).any()) continue;
            const bool material = stack.top().tree().getValue(c) < 0.0f;
            const surface::SurfaceHit hit = material ? beside_voids.closest_point(p, reach, period)
                                                     : scene.closest_point(p, 1e30, period);
            if (hit && (material || sealed[hit.triangle] != 0)) leaf.setValueOnly(k, film.background());
        }
    });
}

}  // namespace

void planarize(MaterialStack& stack, double height) {
    const GridPtr above = plane(stack.domain, height);
    for (Layer& layer : stack.layers) layer.phi = common(stack.domain, *layer.phi, *above);
    cut_layers(stack);
}

void fill(MaterialStack& stack, int material, double height) {
    begin_film(stack, material);
    const GridPtr below = plane(stack.domain, height);
    Layer& film = stack.layers.back();
    film.phi = united(stack.domain, *film.phi, *below);
    cut_layers(stack);
}

void strip(MaterialStack& stack, int material) {
    if (stack.layers.front().material == material)
        throw GeometryError("strip: the substrate cannot be taken away: name another material");
    std::vector<Layer> left;
    GridPtr below, bare;  // level set below: before, and without the material
    bool touched = false;
    for (const Layer& layer : stack.layers) {
        if (layer.material == material)
            touched = true;
        else
            bare = touched ? without(stack.domain, *layer.phi, *below, bare.get()) : layer.phi;
        if (layer.material != material) left.push_back({layer.material, bare});
        below = layer.phi;
    }
    stack.layers = std::move(left);
    cut_layers(stack);
}

void conformal(MaterialStack& stack, int material, double thickness) {
    begin_film(stack, material);
    grow(stack.top(), stack.domain, thickness);
    cut_layers(stack);
}

void mask(MaterialStack& stack, int material, const Shape& pattern, double thickness, bool conformal) {
    const Domain& domain = stack.domain;
    GridPtr film = stack.top().deepCopy();
    if (conformal) grow(*film, domain, thickness);
    const double top = conformal ? highest_front(*film, domain) : highest_front(*film, domain) + thickness;
    if (!conformal) film = plane(domain, top);
    // The pattern's walls end above the film, so that the film keeps its top.
    const GridPtr covered = columns(stack, pattern, -kInfinity, top, -kOverlap * domain.spacing);
    film = common(domain, *film, *covered);
    keep_out_of_voids(*film, stack);
    begin_film(stack, material);
    Layer& layer = stack.layers.back();
    layer.phi = united(domain, *layer.phi, *film);
    cut_layers(stack);
}

void cut(MaterialStack& stack, std::span<const int> materials, const Shape& pattern, double bottom) {
    const Domain& domain = stack.domain;
    const auto goes = [&](const Layer& layer) {
        return std::find(materials.begin(), materials.end(), layer.material) != materials.end();
    };
    if (goes(stack.layers.front()) && std::isinf(bottom))
        throw GeometryError("a cut through the substrate must end at a depth");
    const GridPtr beside =
        columns(stack, pattern, bottom, highest_front(stack.top(), domain), kOverlap * domain.spacing);
    // The level set below each layer: before the cut, and without \p materials anywhere. Null: nothing there.
    GridPtr below, bare;
    bool touched = false;
    for (Layer& layer : stack.layers) {
        const GridPtr own = layer.phi;
        if (goes(layer))
            touched = true;
        else
            bare = touched ? without(domain, *own, *below, bare.get()) : own;
        if (touched && bare)
            layer.phi = combined(domain, std::array<const Grid*, 3>{own.get(), beside.get(), bare.get()},
                                 [](const auto& v) { return std::max(v[0], std::min(v[1], v[2])); });
        else if (touched)
            layer.phi = common(domain, *own, *beside);
        below = own;
    }
    cut_layers(stack);
}

}  // namespace sidewall::levelset
