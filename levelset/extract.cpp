#include "levelset/extract.hpp"

#include "levelset/grid_leaves.hpp"
#include "levelset/level_meshes.hpp"
#include "surface/marching_cubes.hpp"

namespace sidewall::levelset {

TriangleMesh extract_surface(const Grid& grid, const Domain& domain) {
    const surface::LateralGrid box{domain.min, domain.max, domain.cells, domain.spacing};
    return surface::marching_cubes(GridLeaves(grid, domain).list(), box);
}

TriangleMesh extract_surface(const MaterialStack& stack, std::size_t layer) {
    return stack.coarser ? mesh_of_levels(stack, layer)
                         : extract_surface(*stack.layers[layer].phi, stack.domain);
}

TriangleMesh extract_surface(const MaterialStack& stack) {
    return extract_surface(stack, stack.layers.size() - 1);
}

}  // namespace sidewall::levelset
