#pragma once
#include <cstddef>
#include <memory>
#include <span>

#include "levelset/layers/stack.hpp"

namespace sidewall::levelset {

/// Depths of the lower layers under points on the surface. Holds caches: one object a thread.
/// \pre the stack outlives it and does not change meanwhile.
class LayerDepths {
  public:
    explicit LayerDepths(const MaterialStack& stack);

    /// Depth of each lower layer below \p point (index space, on the surface), world units, to \p depth (one
    /// value a layer but the last): at most thinnest_film where the layer is exposed. Where the surface leaves
    /// an exposed layer straight into the one above, as under a mask, it is minus what is left of the layer
    /// there.
    ///
    /// Layers are cut by the surface, so that in the gas they repeat its values: an interface is
    /// extrapolated from the nodes inside alone, by their own slope.
    void at(const Vec3& point, std::span<float> depth) const;

    /// Depths as above, at a fraction of the cost for many points in turn whose \p node, at most a cell away from each,
    /// lies in one leaf.
    void at(const Vec3& point, const Eigen::Vector3i& node, std::span<float> depth);

  private:
    class Reader;
    std::shared_ptr<Reader> reader_;  // by copies, too
};

/// Material of a triangle whose centroid is \p point on the surface, world units: that of the layer exposed there.
int exposed_material(const MaterialStack& stack, const Vec3& point);

}  // namespace sidewall::levelset
