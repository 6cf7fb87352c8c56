#pragma once
#include <utility>
#include <vector>

#include "levelset/grid.hpp"
#include "levelset/shapes.hpp"

namespace sidewall::levelset {

/// One material: everything from the substrate up to and including it lies inside.
struct Layer {
    int material = 0;  ///< the caller's number for it
    GridPtr phi;
};

/// Materials bottom up. Each level set wraps those below it, so that phi of a layer is nowhere above the phi
/// of the one below, and where a lower layer is exposed both hold the same values. The last layer's front is
/// the wafer's surface.
struct MaterialStack {
    Domain domain;
    std::vector<Layer> layers;

    Grid& top() { return *layers.back().phi; }
    const Grid& top() const { return *layers.back().phi; }
};

/// A layer counts as exposed where it lies at most this far (in dx) below the surface: thinner films cannot be
/// told from none, as re-distancing leaves slopes alone that are off by 2 %.
inline constexpr double kExposed = 0.02;

/// The stack of the given bodies, bottom up, each united with all below.
/// \throws GeometryError for a shape that makes no surface in the domain, FileError for a mesh file that
///         cannot be read.
MaterialStack make_stack(const Domain& domain, const std::vector<std::pair<int, Shape>>& bodies);

/// A stack that shares nothing with this one.
MaterialStack copy(const MaterialStack& stack);

/// Puts a film of \p material, still without thickness, on everything, unless it is the uppermost layer
/// already.
void begin_film(MaterialStack& stack, int material);

/// Cuts every layer by the surface after it moved. Layers nearer to it than kExposed coincide with it from
/// then on.
void cut_layers(MaterialStack& stack);

}  // namespace sidewall::levelset
