#include "levelset/extract.hpp"

#include <utility>
#include <vector>

#include "levelset/openvdb_grid.hpp"
#include "surface/marching_cubes.hpp"

namespace sidewall::levelset {
namespace {

// A periodic axis stores nodes 0..cells-1; cells on the high side also need node cells, the image of node 0.
GridPtr with_periodic_images(const Grid& grid, const Domain& domain) {
    GridPtr copy = grid.deepCopy();
    auto to = copy->getAccessor();
    for (int axis = 0; axis < 2; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        if (domain.side[a] != Side::periodic) continue;
        std::vector<std::pair<openvdb::Coord, float>> images;
        for (auto leaf = copy->tree().cbeginLeaf(); leaf; ++leaf) {
            if (leaf->origin()[axis] != 0) continue;
            for (auto it = leaf->cbeginValueOn(); it; ++it) {
                openvdb::Coord c = it.getCoord();
                if (c[axis] != 0) continue;
                c[axis] = domain.cells[a];
                images.emplace_back(c, *it);
            }
        }
        for (const auto& [c, v] : images) to.setValueOn(c, v);
    }
    return copy;
}

}  // namespace

TriangleMesh extract_surface(const Grid& grid, const Domain& domain) {
    const surface::LateralGrid box{domain.min, domain.max, domain.cells, domain.spacing};
    const bool periodic = domain.side[0] == Side::periodic || domain.side[1] == Side::periodic;
    return periodic ? surface::marching_cubes(*with_periodic_images(grid, domain), box)
                    : surface::marching_cubes(grid, box);
}

}  // namespace sidewall::levelset
