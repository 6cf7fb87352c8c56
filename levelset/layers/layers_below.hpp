#pragma once
#include <array>
#include <cstdint>

#include "levelset/layers/stack.hpp"
#include "levelset/openvdb_grid.hpp"

namespace sidewall::levelset {

/// The voxels of a stack's lower layers around one leaf of its surface.
class LayersBelow {
  public:
    /// \param origin  of the leaf.
    LayersBelow(const MaterialStack& stack, const openvdb::Coord& origin);

    /// Whether no lower layer has a leaf at \p origin or around it, where the foot points of its nodes lie.
    static bool none_around(const MaterialStack& stack, const openvdb::Coord& origin);

    /// Whether no lower layer has a voxel that determines the material at a node's foot point: none at the
    /// corners of its cell or beside them, even if the surface lies up to 0.3 dx from that point.
    /// \param foot  the foot point relative to the node, in dx; at most a cell away.
    bool none_near(const openvdb::Coord& node, const Vec3& foot) const;

  private:
    static constexpr int kMargin = 3, kSide = 8 + 2 * kMargin;
    bool any_ = false;
    // Nodes within 2 nodes of a lower layer's voxel, in rows along z: bit z + kMargin.
    std::array<std::uint16_t, static_cast<std::size_t>(kSide* kSide)> near_{};
};

}  // namespace sidewall::levelset
