#pragma once
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "levelset/domain.hpp"
#include "levelset/openvdb_grid.hpp"
#include "surface/extraction/marching_cubes.hpp"

namespace sidewall::levelset {

/// A domain as marching cubes sees it. \param columns  see LateralGrid.
surface::LateralGrid lateral_grid(const Domain& domain, std::span<const surface::CellColumn> columns = {});

/// Values of nodes.
using NodeValues = std::vector<std::pair<openvdb::Coord, float>>;

/// A grid's leaves as marching cubes reads them, in a tree's order. A periodic axis stores nodes 0..cells-1; cells on the
/// high side also need node cells, the image of node 0. Leaves that hold such images are copies.
class GridLeaves {
  public:
    /// \param other  nodes that are to have other values than in the grid.
    GridLeaves(const Grid& grid, const Domain& domain, const NodeValues& other = {});

    const std::vector<const Leaf*>& list() const { return list_; }

  private:
    void set(const NodeValues& values);
    void set_images(int axis, int cells);

    std::vector<const Leaf*> list_;
    std::vector<std::unique_ptr<Leaf>> own_;  // the copies
    float background_;
};

}  // namespace sidewall::levelset
