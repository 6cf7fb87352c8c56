#pragma once
#include <cstddef>
#include <memory>
#include <span>

#include "levelset/layers/stack.hpp"

namespace sidewall::levelset {

/// Depths of the lower layers under points on the surface. Holds caches: use one object per thread.
/// \pre the stack outlives it and does not change meanwhile.
class LayerDepths {
  public:
    explicit LayerDepths(const MaterialStack& stack);

    /// Writes the depth of each lower layer below \p point (index space, on the surface) to \p depth, in
    /// world units, one value for each layer but the last. It is at most thinnest_film where the layer is
    /// exposed. Where the surface's inward normal leads out of an exposed layer straight into the one above,
    /// as under a mask, it is minus the thickness left of the layer.
    ///
    /// Layers are cut by the surface and hold its values in the gas. Interfaces are therefore extrapolated
    /// from inside nodes alone, by the slopes there.
    void at(const Vec3& point, std::span<float> depth) const;

    /// Depths as above at a fraction of the cost, if successive points have their \p node (at most a cell
    /// away from the point) in one leaf.
    void at(const Vec3& point, const Eigen::Vector3i& node, std::span<float> depth);

  private:
    class Reader;
    std::shared_ptr<Reader> reader_;  // shared by copies
};

/// Material of the layer exposed at \p point, a triangle's centroid on the surface; world units.
int exposed_material(const MaterialStack& stack, const Vec3& point);

}  // namespace sidewall::levelset
