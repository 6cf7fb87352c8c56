#pragma once
#include <functional>
#include <optional>
#include <span>

#include "levelset/layers/stack.hpp"
#include "levelset/motion/speed_extension.hpp"

namespace sidewall::levelset {

/// Speed of a crystal's front at a node that it reaches from the edge of its cover (find_bodies): that of the
/// plane that starts at the edge and arrives last (Wulff's construction). Planes parallel to a straight edge
/// start from it; all planes start from a corner.
///
/// None where the grid's scheme is better: at a node straight behind the bare surface, on the edge itself,
/// farther from it than such nodes are held, and where a plane ten times slower than the fastest stops the
/// front.
/// \param planes    normals at which V may have a cusp.
/// \param at        the node's sample.
/// \param body      the crystal's layer.
/// \param fastest   etch rate of the crystal.
/// \param speed_of  V(n), negative.
std::optional<double> crystal_edge_speed(const MaterialStack& stack, std::span<const Vec3> planes,
                                         const SurfaceSample& at, std::size_t body, double fastest,
                                         const std::function<double(const Vec3& normal)>& speed_of);

}  // namespace sidewall::levelset
