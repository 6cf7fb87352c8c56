#pragma once
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "levelset/grid.hpp"
#include "levelset/shapes.hpp"

namespace sidewall::levelset {

/// One material: everything from the substrate up to and including it lies inside.
struct Layer {
    int material = 0;  ///< the caller's number for it
    Grid::Ptr phi;
};

/// Materials bottom up. Each level set wraps those below it, so that phi of a layer is nowhere above the phi
/// of the one below, and where a lower layer is exposed both hold the same values. The last layer's front is
/// the wafer's surface.
struct MaterialStack {
    Domain domain;
    std::vector<Layer> layers;

    Grid& top() { return *layers.back().phi; }
    const Grid& top() const { return *layers.back().phi; }
};

/// A layer counts as exposed where it lies at most this far (in dx) below the surface.
inline constexpr double kExposed = 0.02;

/// The stack of the given bodies, bottom up, each united with all below.
/// \throws GeometryError for a shape that makes no surface in the domain, FileError for a mesh file that
///         cannot be read.
MaterialStack make_stack(const Domain& domain, const std::vector<std::pair<int, Shape>>& bodies);

/// A stack that shares nothing with this one.
MaterialStack copy(const MaterialStack& stack);

/// Puts a film of \p material, still without thickness, on everything, unless it is the uppermost layer
/// already.
void begin_film(MaterialStack& stack, int material);

/// Cuts every layer by the surface after it moved. Layers nearer to it than kExposed coincide with it from
/// then on.
void cut_layers(MaterialStack& stack);

/// How deep every lower layer lies under points on the surface. One a thread.
class LayerDepths {
  public:
    explicit LayerDepths(const MaterialStack& stack);

    /// Depth of each lower layer below \p point (index space, on the surface), world units, to \p depth (one
    /// value a layer but the last): at most kExposed dx where the layer is exposed. Where the surface leaves
    /// an exposed layer straight into the one above, as under a mask, it is minus what is left of the layer
    /// there.
    ///
    /// Layers are cut by the surface, so that in the gas they repeat its values: only nodes inside tell where
    /// an interface is, and it is extrapolated from them by their own slope.
    void at(const Vec3& point, std::span<float> depth) const;

  private:
    /// What one node inside tells of a layer: how deep it lies below the point, and both fronts' rise a cell.
    struct Reading {
        float depth = 0.0f;
        Eigen::Vector3f rise = Eigen::Vector3f::Zero(), surface_rise = Eigen::Vector3f::Zero();
    };
    Reading read(std::size_t layer, const openvdb::Coord& node, const Vec3& point) const;
    openvdb::Coord own(const openvdb::Coord& node) const;
    bool solid(const openvdb::Coord& own_node) const;
    float value(std::size_t layer, const openvdb::Coord& own_node) const;

    const MaterialStack& stack_;
    float dx_;
    Grid::ConstUnsafeAccessor top_;
    std::vector<Grid::ConstUnsafeAccessor> layers_;
};

/// Index of the layer exposed at a world point on the surface.
std::size_t exposed_layer(const MaterialStack& stack, const Vec3& point);

/// Material of a triangle whose centroid is \p point on the surface (see exposed_layer).
int exposed_material(const MaterialStack& stack, const Vec3& point);

}  // namespace sidewall::levelset
