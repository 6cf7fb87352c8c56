#pragma once
#include <array>
#include <memory>
#include <vector>

#include "levelset/band.hpp"
#include "levelset/motion/motion.hpp"
#include "levelset/openvdb_grid.hpp"

namespace sidewall::levelset {

/// Upper limits of phi after a time step in bodies beside the etched one. Without them, a node in a mask
/// whose closest surface point lies on the silicon that recedes under it would move with that speed, up to
/// cfl dx past the mask's underside. A body lies between one layer's level set and the next. In it phi may
/// rise to the body's old surface plus what the body itself can lose; at neighbours, by dx more. Only nodes
/// near what the time step has moved are limited.
class Limits {
  public:
    /// \param stack     lower layers from before the time step, surface after it.
    /// \param band      of the moved surface.
    /// \param moved     by leaf of the band: whether the time step has moved phi in it.
    /// \param before    phi of the band's leaves before the time step, one after the other.
    /// \param motion    V, the samples' thicknesses and the bodies' largest etch rates.
    /// \param duration  of the time step.
    /// \note O(n), parallel.
    Limits(const MaterialStack& stack, const Band& band, const std::vector<std::uint8_t>& moved,
           const float* before, const Motion& motion, double duration);

    /// Lowers phi to the limits, within the band.
    void keep(Grid& phi) const;

  private:
    using Values = std::array<float, Leaf::SIZE>;
    struct Limited {
        openvdb::Coord origin;
        std::unique_ptr<const Values> most;  // infinite where nothing limits phi
    };
    std::vector<Limited> leaves_;
};

}  // namespace sidewall::levelset
