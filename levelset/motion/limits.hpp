#pragma once
#include <array>
#include <memory>
#include <vector>

#include "levelset/motion/band.hpp"
#include "levelset/motion/motion.hpp"
#include "levelset/openvdb_grid.hpp"

namespace sidewall::levelset {

/// How far a time step may raise phi in bodies beside the one that it etches: a node in a mask whose nearest
/// surface point is on the silicon that recedes under it moves with that speed, up to cfl dx past the mask's own
/// underside. A body is what lies between one layer's level set and the next. In it phi may rise to the body's
/// old surface and by what the body itself can lose, and at the neighbours by their distance more. Looked for where the
/// time step has moved something near.
class Limits {
  public:
    /// \param stack     its lower layers as before the time step, its surface moved.
    /// \param band      of the moved surface.
    /// \param moved     by leaf of the band: the time step has moved phi in it.
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
