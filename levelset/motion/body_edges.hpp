#pragma once
#include <cstddef>

#include "levelset/layers/stack.hpp"
#include "levelset/motion/speed_extension.hpp"

namespace sidewall::levelset {

/// Layer exposed at a sample: the lowest one that (nearly) touches the surface.
/// \pre find_bodies has been called.
std::size_t exposed(const MaterialStack& stack, const Extension& extension, std::size_t sample);

/// What find_bodies determines.
enum class Below {
    nothing,  ///< no lower layer matters: all count as deeper than the band
    depths,   ///< the layers' depths
    edges     ///< the depths, and the nodes at the edges of bodies
};

/// Finds the depth of each layer below the samples (Extension::thickness), and the nodes at the edge of a
/// body that continues under another one, as silicon does under a mask.
///
/// The closest surface point of such a node lies on the edge, where the other body counts as exposed. Yet the
/// front reaches the node through the node's body, at that body's rate (Huygens' principle with the other
/// body as an obstacle). The node therefore gets an additional sample, after all others, and its body in
/// Extension::body.
///
/// \param look_for  Below::edges if the speed at an edge is that of a face beside it or follows from V(n)
///     there. Not if it comes from averaged or broad fluxes with yields by angle, which are not known for
///     the fan of normals at an edge.
/// \note Parallel over leaves, deterministic.
void find_bodies(const MaterialStack& stack, Extension& extension, Below look_for = Below::edges);

}  // namespace sidewall::levelset
