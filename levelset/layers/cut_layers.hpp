#pragma once
#include "levelset/layers/release.hpp"
#include "levelset/layers/stack.hpp"

namespace sidewall::levelset {

/// Cuts every layer by the surface after it moved. Layers nearer to it than thinnest_film coincide with it from
/// then on, but for \p grown nodes: a film may grow by less than that in a time step.
void cut_layers(MaterialStack& stack, const Grown* grown = nullptr);

}  // namespace sidewall::levelset
