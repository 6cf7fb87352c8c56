#include "levelset/meshes/extract.hpp"

#include "levelset/grid.hpp"
#include "levelset/meshes/level_meshes.hpp"

namespace sidewall::levelset {

TriangleMesh extract_surface(const MaterialStack& stack, std::size_t layer) {
    return stack.coarser ? mesh_of_levels(stack, layer, nullptr)
                         : extract_surface(*stack.layers[layer].phi, stack.domain);
}

TriangleMesh extract_surface(const MaterialStack& stack) {
    return extract_surface(stack, stack.layers.size() - 1);
}

TriangleMesh extract_around(const MaterialStack& stack, std::size_t layer, const surface::Plane& plane) {
    return mesh_of_levels(stack, layer, &plane);
}

}  // namespace sidewall::levelset
