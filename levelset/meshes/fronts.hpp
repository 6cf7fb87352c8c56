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
    std::array<openvdb::Coord, 2> node;  ///< own nodes, low end first
    int axis = 0;
    double t = 0.0;         ///< of the vertex, from the low end
    std::size_t level = 0;  ///< whose edge it is, the finest being 0
    /// False of vertices within a cell, as where levels meet. With one level these, which divide a mesh on the way, count
    /// as on the nearest edge.
    bool is_one = true;
};

/// Values of all layers and of their continued fronts (continued_fronts in fronts.cpp). Copies share the grids and keep look-up
/// caches: one a thread.
/// \pre the stack outlives it and does not change meanwhile.
class Fronts {
  public:
    explicit Fronts(const MaterialStack& stack);

    GridEdge edge_of(const Vec3& point) const;
    /// Value of a layer at an end of an edge.
    double value(std::size_t layer, const GridEdge& edge, std::size_t end) const {
        return static_cast<double>(levels_[edge.level].own[layer].getValue(edge.node[end]));
    }
    /// Value of a layer's continued front at an end of an edge. Outside all bands that share the surface's voxels the layer lies deeper: far below the node.
    double continued(std::size_t layer, const GridEdge& edge, std::size_t end) const {
        return static_cast<double>(levels_[edge.level].continued[layer].getValue(edge.node[end]));
    }
    /// Height above a layer's continued front at a point, in cells, trilinear.
    double height(std::size_t layer, const Vec3& point) const;
    double spacing(const GridEdge& edge) const { return levels_[edge.level].stack->domain.spacing; }
    /// Grid spacing of the level that counts at a point.
    double spacing(const Vec3& point) const { return levels_[level_of(point)].stack->domain.spacing; }
    /// In cells of the edge's level, what lies so near to a front lies on it.
    double touching(const GridEdge& edge) const {
        return kExposed / levels_[edge.level].stack->domain.times_finest;
    }

  private:
    struct Level {
        const MaterialStack* stack;
        std::vector<GridPtr> grids;  // the continued fronts
        std::vector<Grid::ConstUnsafeAccessor> own, continued;
    };
    // The finest one that counts on any side of the point.
    std::size_t level_of(const Vec3& point) const;

    std::vector<Level> levels_;
};

/// The edges that a layer's interface may have in a cell of a level: those of the layer's own front where the nodes around are
/// all bare, or under the thinnest film, or all covered by as much as edges_below asks; none where a cover ends. What covers a node is
/// the lowest layer above that has a thickness there.
surface::SharpEdges edges_at(const MaterialStack& level, std::size_t layer, const std::array<int, 3>& cell);

/// The edges with which a layer's own front is its interface everywhere: all where the next layer covers it by half a cell at least, hollow
/// ones where by a quarter. Under less it may end on the next one's front: none.
surface::SharpEdges edges_below(const MaterialStack& stack, std::size_t layer);

}  // namespace sidewall::levelset
