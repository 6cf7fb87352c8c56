#pragma once
#include <array>
#include <cstddef>
#include <vector>

#include "levelset/layers/stack.hpp"
#include "levelset/openvdb_grid.hpp"
#include "surface/extraction/marching_cubes.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::levelset {

/// The edge of the grid that a vertex of an extracted mesh lies on.
struct GridEdge {
    std::array<openvdb::Coord, 2> node;  ///< its ends, low one first; ghosts by their source nodes
    int axis = 0;
    double t = 0.0;         ///< place of the vertex, 0 at the low end, 1 at the high one
    std::size_t level = 0;  ///< of the grid that has the edge; 0 is the finest
    /// False for vertices within a cell, as where levels meet. Always true with one level: there vertices
    /// within a cell, which come from divided meshes, count as on the nearest edge.
    bool on_grid_edge = true;
};

/// Reads the values of all layers and of their continued fronts (continued_fronts in fronts.cpp), in world
/// units. Copies share the grids and have separate look-up caches: use one copy per thread.
/// \pre the stack outlives it and does not change meanwhile.
class Fronts {
  public:
    explicit Fronts(const MaterialStack& stack);

    GridEdge edge_of(const Vec3& point) const;
    /// Value of a layer at an end of an edge.
    double value(std::size_t layer, const GridEdge& edge, std::size_t end) const {
        return static_cast<double>(levels_[edge.level].own[layer].getValue(edge.node[end]));
    }
    /// Value of a layer's continued front at an end of an edge. Outside the front's band it is the
    /// background: the front lies far below the node.
    double continued(std::size_t layer, const GridEdge& edge, std::size_t end) const {
        return static_cast<double>(levels_[edge.level].continued[layer].getValue(edge.node[end]));
    }
    /// Height above a layer's continued front at a point, in cells, trilinear.
    double height(std::size_t layer, const Vec3& point) const;
    double spacing(const GridEdge& edge) const { return levels_[edge.level].stack->domain.spacing; }
    /// Grid spacing of the level that counts at a point.
    double spacing(const Vec3& point) const { return levels_[level_of(point)].stack->domain.spacing; }
    /// Fronts nearer to each other than this coincide, in cells of the edge's level (thinnest_film).
    double touching(const GridEdge& edge) const {
        return kExposed / levels_[edge.level].stack->domain.times_finest;
    }

  private:
    struct Level {
        const MaterialStack* stack;
        std::vector<GridPtr> grids;  // the continued fronts
        std::vector<Grid::ConstUnsafeAccessor> own, continued;
    };
    // The finest level that counts in a column beside the point.
    std::size_t level_of(const Vec3& point) const;

    std::vector<Level> levels_;
};

/// The sharp edges that a layer's interface may have in a cell of a level: those of the layer's own front if
/// the nodes around are all bare (covered by at most 0.15 cells) or all covered as edges_below requires; none
/// where a cover ends. A node's cover is the lowest layer above with a thickness there.
surface::SharpEdges edges_at(const MaterialStack& level, std::size_t layer, const std::array<int, 3>& cell);

/// The sharp edges with which a layer's own front is its interface everywhere: all if the next layer covers
/// it by at least 0.5 cells, hollow ones if by 0.15. Under less it may end on the next front: none.
surface::SharpEdges edges_below(const MaterialStack& stack, std::size_t layer);

}  // namespace sidewall::levelset
