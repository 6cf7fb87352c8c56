#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "levelset/grid.hpp"
#include "levelset/shapes/shapes.hpp"

namespace sidewall::levelset {

/// One material: everything from the substrate up to and including it lies inside.
struct Layer {
    int material = 0;  ///< the caller's number for it
    GridPtr phi;
};

/// The columns of nodes, from the wafer's bottom to its top, that a level is responsible for (levelset/layers/levels.hpp).
struct LevelColumns {
    /// Nodes along a column's sides: a leaf, of which four lie over one of the next coarser level.
    static constexpr int kNodes = 8, kShift = 3;

    std::array<int, 2> count{};     ///< along x and y
    std::vector<std::uint8_t> own;  ///< by column, y fastest: this level counts there, else a coarser one

    std::uint8_t& at(int x, int y) { return own[static_cast<std::size_t>(x * count[1] + y)]; }
    bool at(int x, int y) const { return own[static_cast<std::size_t>(x * count[1] + y)] != 0; }
    /// Of an own node of the level's domain, by its indices.
    bool of_node(int i, int j) const { return at(i >> kShift, j >> kShift); }
    /// Of an own node of the next coarser level's domain, by its indices.
    bool of_coarser_node(int i, int j) const { return at(i >> (kShift - 1), j >> (kShift - 1)); }
};

/// Materials bottom up. Each level set wraps those below it, so that phi of a layer is nowhere above the phi
/// of the one below, and where a lower layer is exposed both hold the same values. The last layer's front is
/// the wafer's surface.
struct MaterialStack {
    Domain domain;
    std::vector<Layer> layers;
    /// The same materials at twice the spacing; null if there is one level alone, as there is unless
    /// levelset/layers/levels.hpp has made more.
    std::shared_ptr<MaterialStack> coarser = nullptr;
    LevelColumns columns = {};  ///< where this level counts, if there is a coarser one
    int margin = 0;             ///< leaves around its columns, whose values come from the coarser level

    Grid& top() { return *layers.back().phi; }
    const Grid& top() const { return *layers.back().phi; }
};

/// A layer counts as exposed where it lies at most this far below the surface, in cells of the finest level: there thinner
/// films cannot be told from none, as re-distancing leaves slopes alone that are off by 2 %. What a film of many cycles
/// loses by it is the same on all levels.
inline constexpr double kExposed = 0.02;

/// The same as a length.
inline double thinnest_film(const Domain& domain) {
    return kExposed * domain.finest_spacing();
}

/// The stack of the given bodies, bottom up, each united with all below.
/// \throws GeometryError for a shape that makes no surface in the domain, FileError for a mesh file that
///         cannot be read.
MaterialStack make_stack(const Domain& domain, const std::vector<std::pair<int, Shape>>& bodies);

/// A stack that shares nothing with this one.
MaterialStack copy(const MaterialStack& stack);

/// Puts a film of \p material, still without thickness, on everything, unless it is the uppermost layer
/// already.
void begin_film(MaterialStack& stack, int material);

struct Grown;  // levelset/motion/release.hpp

/// Cuts every layer by the surface after it moved. Layers nearer to it than thinnest_film coincide with it from
/// then on, but for \p grown nodes: a film may grow by less than that in a time step.
void cut_layers(MaterialStack& stack, const Grown* grown = nullptr);

}  // namespace sidewall::levelset
