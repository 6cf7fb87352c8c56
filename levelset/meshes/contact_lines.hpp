#pragma once
#include <cstdint>
#include <vector>

#include "levelset/layers/stack.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::levelset {

/// A mesh whose triangles end where the material below them changes; it stays the same surface.
struct CutMesh {
    /// A vertex that the mesh did not have before, and the edge that it divides.
    struct Added {
        std::uint32_t from = 0, to = 0;  ///< vertices before it
        double share = 0.0;              ///< of the way
    };
    TriangleMesh mesh;               ///< vertices as they were, then those added; no attributes
    std::vector<Added> added;        ///< in the order of their vertices
    std::vector<std::size_t> layer;  ///< by triangle: the layer exposed there
};

/// The wafer's surface and what it covers.
struct StackMeshes {
    CutMesh surface;
    std::vector<TriangleMesh> interfaces;  ///< by layer but the last: its boundary to all above; may be empty
};

/// The fronts of all layers as meshes that meet at their contact lines. Marching cubes of each layer alone would cut off
/// a layer's corner under a mask and fill the surface's there, and leave between the two a tooth of the mask's material a
/// cell long. Here the surface's triangles are divided where the layer's own front, continued (continued_fronts), meets
/// them, and each interface ends on that line.
///
/// \param surface  extract_surface of the stack's top, which keeps its edges. Where a lower layer comes out along one of them, as
///                 at a mask's foot, the line runs on it (kOnLine). Interfaces have edges where they are bare or well covered
///                 (edges_at), none of them outside of what lies on them. A layer that is covered all over has its front's
///                 edges on its interface (edges_below).
/// \note O(n) for each pair of layers. The same bits on any number of threads.
StackMeshes extract_materials(const MaterialStack& stack, const TriangleMesh& surface);

}  // namespace sidewall::levelset
