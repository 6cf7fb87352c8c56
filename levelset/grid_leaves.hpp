#pragma once
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "levelset/domain.hpp"
#include "levelset/openvdb_grid.hpp"
#include "surface/extraction/marching_cubes.hpp"

namespace sidewall::levelset {

/// The lateral box of \p domain for marching cubes. \param columns  see LateralGrid.
surface::LateralGrid lateral_grid(const Domain& domain, std::span<const surface::CellColumn> columns = {});

/// Nodes with a value each.
using NodeValues = std::vector<std::pair<openvdb::Coord, float>>;

/// A grid's leaves for marching cubes, in a tree's order. A periodic axis stores nodes 0..cells-1; cells at
/// the high side also need node number `cells`, the image of node 0. Leaves that hold such images are copies.
class GridLeaves {
  public:
    /// \param other  nodes whose values replace those of the grid.
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
