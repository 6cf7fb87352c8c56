#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "levelset/domain.hpp"
#include "levelset/narrow_band.hpp"

namespace sidewall::levelset {

/// One material. Its level set encloses everything from the substrate up to and including it.
struct Layer {
    int material = 0;  ///< the caller's number for it
    GridPtr phi;
};

/// The columns of nodes, from the wafer's bottom to its top, that a level is responsible for
/// (levelset/layers/levels.hpp).
struct LevelColumns {
    /// Width of a column in nodes: one leaf. Four leaves lie over one of the next coarser level.
    static constexpr int kNodes = 8, kShift = 3;

    std::array<int, 2> count{};     ///< along x and y
    std::vector<std::uint8_t> own;  ///< by column, y fastest: this level counts there, else a coarser one

    std::uint8_t& at(int x, int y) { return own[static_cast<std::size_t>(x * count[1] + y)]; }
    bool at(int x, int y) const { return own[static_cast<std::size_t>(x * count[1] + y)] != 0; }
    /// Whether the level counts in the column of an own node of its domain, by the node's indices.
    bool of_node(int i, int j) const { return at(i >> kShift, j >> kShift); }
    /// Whether it counts in the column of an own node of the next coarser level's domain.
    bool of_coarser_node(int i, int j) const { return at(i >> (kShift - 1), j >> (kShift - 1)); }
    /// Equally many columns, in none of which the level counts.
    LevelColumns none() const { return {count, std::vector<std::uint8_t>(own.size(), 0)}; }
};

/// Materials bottom up. Each level set wraps those below it, so that phi of a layer is nowhere above the phi
/// of the one below, and where a lower layer is exposed both hold the same values. The last layer's front is
/// the wafer's surface.
struct MaterialStack {
    Domain domain;
    std::vector<Layer> layers;
    /// The next coarser level: the same materials at twice the spacing. Null on the coarsest level, which is
    /// the only one unless levelset/layers/levels.hpp has made more.
    std::shared_ptr<MaterialStack> coarser = nullptr;
    LevelColumns columns = {};  ///< where this level counts, if there is a coarser one
    int margin = 0;             ///< leaves around its columns, whose values come from the coarser level

    Grid& top() { return *layers.back().phi; }
    const Grid& top() const { return *layers.back().phi; }
};

/// Whether a level counts at one of its nodes, by the node's indices.
/// \param finer  the next finer level, or null.
inline bool counts_at(const MaterialStack& level, const MaterialStack* finer, int i, int j) {
    const bool own = !level.coarser || level.columns.of_node(i, j);
    return own && (finer == nullptr || !finer->columns.of_coarser_node(i, j));
}

/// A layer counts as exposed where it lies at most this deep below the surface, in cells of the finest level:
/// thinner films cannot be resolved, as re-distancing accepts slopes that are off by 2 %. A film of many
/// cycles loses the same by it on all levels.
inline constexpr double kExposed = 0.02;

/// kExposed as a length.
inline double thinnest_film(const Domain& domain) {
    return kExposed * domain.finest_spacing();
}

/// A stack that shares nothing with this one.
MaterialStack copy(const MaterialStack& stack);

/// Puts a film of \p material and thickness 0 on everything, unless it is the uppermost layer already.
void begin_film(MaterialStack& stack, int material);

/// Calls use(x, y) with the columns of 2^\p shift nodes a side (LevelColumns) that hold the source nodes of
/// all nodes from \p low to \p high along x and y. A column may come twice.
template <class Use>
void each_column_between(const Domain& domain, std::array<int, 2> low, std::array<int, 2> high, int shift,
                         Use&& use) {
    std::array<std::vector<int>, 2> columns;
    for (int axis = 0; axis < 2; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        for (int node = low[a]; node <= high[a]; ++node)  // beyond a side, columns may begin anywhere
            if (const int column = domain.source_node(axis, node) >> shift;
                columns[a].empty() || columns[a].back() != column)
                columns[a].push_back(column);
    }
    for (const int x : columns[0])
        for (const int y : columns[1]) use(x, y);
}

/// Volume left of a layer, counted until it reaches \p enough. Only nodes near its front count, and only
/// where it is thicker than thinnest_film, below which it cannot be resolved; a thick layer holds more.
/// \param start  in: leaf number to begin at, any; out: the leaf where some was found, to begin at next time.
/// \returns the volume left, or the part counted when it was enough.
/// \note O(1) while there is enough where the count begins, else O(n) at most.
double volume_left(const MaterialStack& stack, std::size_t layer, double enough, std::size_t& start);

/// Removes buried layers of which less than a cell of the finest level is left, except the substrate; what is
/// left joins the layer above. Such layers cost time in every later step, and their meshes would be scraps.
/// \param volumes  by layer, between its front and that of the layer below. A film too thin for the grid has
///                 a volume here and stays.
/// \returns whether there were any.
bool drop_spent_layers(MaterialStack& stack, std::span<const double> volumes);

}  // namespace sidewall::levelset
