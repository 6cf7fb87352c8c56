#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "surface/extraction/float_grid.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::surface {

/// The leaves of a FloatGrid's tree.
using FloatLeaf = openvdb::tree::LeafNode<float, 3>;

/// What is made of a column of cells.
enum class CellColumn : std::uint8_t {
    left_out,
    bare,      ///< left out, with no vertices on its cells' edges, whatever the next column is
    vertices,  ///< vertices on the cells' edges, no triangles
    meshed
};

/// Where the mesh gets vertices on the edges and corners of the surface (see sharp_edges.hpp).
enum class SharpEdges : std::uint8_t {
    none,    ///< nowhere: marching cubes alone, which cuts edges off by up to a cell
    hollow,  ///< where the surface bends towards the gas, as at the foot of a wall
    all,
    all_beyond  ///< all, also if the apex lies a fraction of a cell beyond a periodic side, where the mesh
                ///< leaves its box: for volumes
};

/// The lateral box of a level set: nodes 0..cells per axis are meshed; the surface ends exactly on the sides.
struct LateralGrid {
    std::array<double, 2> min{};  ///< world x, y of node 0
    std::array<double, 2> max{};  ///< world x, y of node cells: boundary vertices get these very numbers
    std::array<int, 2> cells{};
    double spacing = 0.0;  ///< dx; node k along z lies at k dx
    /// By column of cells, y fastest: what is made of them. Empty: all are meshed.
    std::span<const CellColumn> columns = {};
    /// Whether node `cells` of an axis is the image of node 0; else values mirror at the sides. For sharp
    /// edges.
    std::array<bool, 2> periodic{};
    /// Nodes with |phi| below this lie on the surface and count as outside: rounding differs with the wafer's
    /// place and the unit of length.
    double on_node = 0.0;
    /// Gives the sharp edges that a cell may have at most, by its low corner; empty: all.
    std::function<SharpEdges(const std::array<int, 3>&)> edges_in = {};
};

/// Edge intersections keep this fraction of a cell away from nodes, so that no triangle has zero area.
inline constexpr double kNodeClearance = 1e-3;

/// What an edge of the surface is; 0 stands for none.
enum class EdgeKind : std::uint8_t { hollow = 1, convex, corner };

/// The vertices of a mesh that lie on edges and corners: first, first + 1 ...
struct SharpVertices {
    std::uint32_t first = 0;
    std::vector<EdgeKind> kind;  ///< of each
};

/// Extracts the zero level of leaves of a level set (negative inside; active voxels are the narrow band) by
/// marching cubes (Lorensen and Cline, 1987). Ambiguous faces separate the inside nodes in both cells, and no
/// polygon is cut along a face: the mesh is watertight and manifold but for its boundary on the sides.
///
/// \param leaves  in a grid's order; they need not be all of one grid.
/// \param mesh    gets the vertices, in world units, and the triangles, counter-clockwise seen from the
///     positive side; their order depends on the leaves alone.
/// \param edges   which edges of the surface get additional vertices; the mesh stays watertight and manifold.
/// \returns the vertices on edges, which come after all others.
/// \throws NumericsError if the band is too thin to hold the cells that the surface passes through.
/// \note Parallel over leaves, linear in active voxels.
SharpVertices marching_cubes(const std::vector<const FloatLeaf*>& leaves, const LateralGrid& box,
                             TriangleMesh& mesh, SharpEdges edges = SharpEdges::none);

/// The triangulation of each of the 256 sign patterns: bit c of the pattern set = corner c inside; corner c
/// has x = c & 1, y = c >> 1 & 1, z = c >> 2. Three edges a triangle; edge 4 a + b runs along axis a.
const std::array<std::vector<std::uint8_t>, 256>& marching_cubes_table();

/// The polygon that a sign pattern's triangles fill, as edges in their order; empty if there are several.
const std::vector<int>& polygon_of(std::size_t pattern);

/// First corner of a cell edge; the second is the first + (1 << edge / 4).
constexpr int edge_corner(int edge) {
    const int axis = edge / 4, rest = edge % 4;
    const int low = rest & ((1 << axis) - 1);
    return (rest - low) * 2 + low;
}

}  // namespace sidewall::surface
