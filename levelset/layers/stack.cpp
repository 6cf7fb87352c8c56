#include "levelset/layers/stack.hpp"

#include "levelset/openvdb_grid.hpp"

namespace sidewall::levelset {

MaterialStack copy(const MaterialStack& stack) {
    MaterialStack result = stack;
    for (Layer& layer : result.layers) layer.phi = layer.phi->deepCopy();
    if (stack.coarser) result.coarser = std::make_shared<MaterialStack>(copy(*stack.coarser));
    return result;
}

void begin_film(MaterialStack& stack, int material) {
    if (stack.layers.back().material == material) return;
    stack.layers.push_back({material, stack.top().deepCopy()});
    if (stack.coarser) begin_film(*stack.coarser, material);
}

}  // namespace sidewall::levelset
