#pragma once
#include <functional>
#include <optional>
#include <span>

#include "levelset/layers/stack.hpp"
#include "levelset/motion/speed_extension.hpp"

namespace sidewall::levelset {

/// Speed at which a crystal's front gets to a node from the edge of what covers it (find_bodies): that of the plane that sets out
/// from the edge and gets to the node last (Wulff's construction). From a straight edge planes set out that are parallel to it,
/// from its corners all.
///
/// None where the grid's scheme is the better one: at a node straight behind the bare surface, at the edge itself, farther from
/// it than such nodes are held, and where a plane stops the front that is ten times slower than the fastest.
/// \param planes    normals at which V may have a cusp.
/// \param at        the node's sample.
/// \param body      the crystal's layer.
/// \param fastest   etch rate of the crystal.
/// \param speed_of  V(n), negative.
std::optional<double> crystal_edge_speed(const MaterialStack& stack, std::span<const Vec3> planes,
                                         const SurfaceSample& at, std::size_t body, double fastest,
                                         const std::function<double(const Vec3& normal)>& speed_of);

}  // namespace sidewall::levelset
