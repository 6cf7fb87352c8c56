#pragma once
#include <cstdint>
#include <vector>

#include "levelset/layers/stack.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::levelset {

/// A mesh divided so that each triangle lies on one layer; the surface itself is unchanged.
struct CutMesh {
    /// An added vertex and the edge that it divides.
    struct Added {
        std::uint32_t from = 0, to = 0;  ///< vertices at the ends of the edge
        double share = 0.0;              ///< place on the edge: 0 at from, 1 at to
    };
    TriangleMesh mesh;               ///< the original vertices, then those added; no attributes
    std::vector<Added> added;        ///< in the order of their vertices
    std::vector<std::size_t> layer;  ///< by triangle: the layer exposed there
};

/// Meshes of the wafer's surface and of the interfaces below it.
struct StackMeshes {
    CutMesh surface;
    std::vector<TriangleMesh> interfaces;  ///< by layer but the last: boundary to all above, or empty
};

/// Extracts the fronts of all layers as meshes that meet at their contact lines. Separate marching cubes of
/// each layer would cut off a layer's corner under a mask, fill the surface's corner there, and leave a tooth
/// of mask material a cell long between the two. Instead the surface's triangles are divided where they meet
/// the layer's own front, continued beyond its end (continued_fronts), and each interface ends on that line.
///
/// \param surface  extract_surface of the stack's top, with its sharp edges. A contact line along such an
///     edge, as at a mask's foot, runs on the edge (kOnLine).
/// \returns the meshes. Interfaces have sharp edges where they are bare or well covered (edges_at), none
///     outside of what lies on them. A layer that is covered everywhere has all edges of its front
///     (edges_below).
/// \note O(n) for each pair of layers. The same bits on any number of threads.
StackMeshes extract_materials(const MaterialStack& stack, const TriangleMesh& surface);

}  // namespace sidewall::levelset
