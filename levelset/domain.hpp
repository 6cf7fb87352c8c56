#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "surface/vec3.hpp"

namespace sidewall::levelset {

enum class Side : std::uint8_t { reflective, periodic };

/// The simulated box: lateral sides on grid nodes, z open. Node (i, j, k) lies at (min[0] + i dx, min[1] + j
/// dx, k dx).
///
/// A grid stores the domain's own nodes only: 0..cells on a reflective axis, 0..cells-1 on a periodic one.
/// All others are ghosts without storage: reading one means reading its source node (source_node), so a ghost
/// can never be stale.
struct Domain {
    std::array<double, 2> min{};  ///< world x, y of the low sides
    std::array<double, 2> max{};  ///< world x, y of the high sides
    std::array<int, 2> cells{};   ///< whole cells along x and y
    double spacing = 0.0;         ///< dx
    std::array<Side, 2> side{};   ///< lateral boundary condition, per axis
    /// A half plane (r = x >= 0, z), one cell wide along y, that is revolved about z (flux/revolution.hpp).
    bool axial = false;
    int times_finest = 1;  ///< dx over that of the finest level (levelset/layers/levels.hpp)

    /// Own node whose value a node at \p index along \p axis (0 = x, 1 = y) repeats: mirrored about a side's
    /// node or wrapped; the identity for own nodes. Any distance from the box is allowed.
    int source_node(int axis, int index) const {
        const auto a = static_cast<std::size_t>(axis);
        const int n = cells[a], period = side[a] == Side::periodic ? n : 2 * n;
        int i = index % period;
        if (i < 0) i += period;
        return side[a] == Side::periodic || i <= n ? i : period - i;
    }
    /// Last own node along \p axis.
    int last_node(int axis) const {
        const auto a = static_cast<std::size_t>(axis);
        return side[a] == Side::periodic ? cells[a] - 1 : cells[a];
    }
    /// Length after which the wafer repeats along x and y; 0 between reflective sides, and along an axis of one
    /// cell, where it does not change.
    std::array<double, 2> period() const {
        const auto along = [&](std::size_t a) {
            return side[a] == Side::periodic && cells[a] > 1 ? max[a] - min[a] : 0.0;
        };
        return {along(0), along(1)};
    }
    double finest_spacing() const { return spacing / times_finest; }
    bool owns(int i, int j) const { return i >= 0 && j >= 0 && i <= last_node(0) && j <= last_node(1); }

    /// World coordinate of node \p index; nodes on the sides give min and max to the last bit.
    double coordinate(int axis, int index) const {
        if (axis == 2) return index * spacing;
        const auto a = static_cast<std::size_t>(axis);
        return index == cells[a] ? max[a] : min[a] + index * spacing;
    }
    /// World point to fractional node indices.
    Vec3 to_index(const Vec3& p) const {
        return {(p.x() - min[0]) / spacing, (p.y() - min[1]) / spacing, p.z() / spacing};
    }
};

/// A domain of \p extent (x, y), centred on 0, with the spacing nearest to \p spacing that divides both
/// extents.
/// \throws RecipeError if an extent or the spacing is not positive and finite, or if no spacing within 25 %
///         divides both extents (the message suggests what to change).
Domain make_domain(std::array<double, 2> extent, double spacing, std::array<Side, 2> side);

}  // namespace sidewall::levelset
