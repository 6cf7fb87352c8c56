#pragma once
#include <functional>
#include <vector>

#include "levelset/grid.hpp"
#include "levelset/layers/stack.hpp"

/// Levels of a stack: the same materials at the finest spacing, at twice and at four times it. A level counts
/// (gives the surface) in the columns where the wafer has features that the next coarser one cannot resolve.
/// Its grids hold these columns and a margin around them, those of the coarsest level everything. Each level
/// moves by itself, margin included, except for parts deep under a finer level, which take that level's
/// values. Afterwards levels exchange values: shared nodes of the coarser one take the finer one's
/// (injection), and margins are interpolated from the coarser level by cubics (prolongation). All that a time
/// step or a re-distancing reads lies within the margin.
///
///           | margin | own columns of the finer level  | margin |
///     ------+--------+---------------------------------+--------+------    coarser level, everywhere
///                ^ prolongation      v injection            ^
namespace sidewall::levelset {

/// A domain of the box at twice the spacing.
/// \pre even numbers of cells along x and y.
Domain coarser_domain(const Domain& domain);

/// Every column of a domain.
LevelColumns all_columns(const Domain& domain);

/// The number of levels: 1 without coarser ones.
int level_count(const MaterialStack& stack);

/// The most levels (1 to 3) that a domain can have: each halves its numbers of cells, down to at least 4.
int most_levels(const Domain& domain);

/// Adds coarser levels to a stack of one level, for \p levels in all; the finest stays around features.
/// \pre levels <= most_levels
void make_levels(MaterialStack& stack, int levels, int margin);

/// Samples the same layers on a domain of any spacing, in some columns (levelset/layers/make_stack.hpp).
using StackSampler = std::function<MaterialStack(const Domain& domain, const LeafChoice& where)>;

/// Makes a stack of several levels, each sampled where it counts and little beyond.
/// \param domain  of the finest level.
/// \pre 2 <= levels <= most_levels
MaterialStack make_levels(const Domain& domain, int levels, int margin, const StackSampler& sample);

/// A copy with the finest level alone, everywhere: interpolated where coarser levels count.
MaterialStack on_one_level(const MaterialStack& stack);

/// Exchanges values after all levels have moved: injection (except in deep_columns), then prolongation.
void exchange_levels(MaterialStack& stack);

/// Chooses the columns of every level anew: those in which the next coarser level finds, in a layer's front,
/// a radius of curvature below kNeeded of its cells (Lenz et al., J. Sci. Comput. 2023,
/// 10.1007/s10915-023-02133-5, refine by curvature, too), or a gap or a piece of material less than four
/// cells thick; those that such a feature may reach until the next choice; and those of \p wanted (by level,
/// or empty). Columns are given up only where radii are above kGivenUp cells.
void choose_columns(MaterialStack& stack, const std::vector<LevelColumns>& wanted);

/// Columns of \p finer under which the next coarser level need not move but takes the values of \p finer:
/// nothing outside of them reads these leaves within a time step. All columns over one coarser leaf have the
/// same flag.
LevelColumns deep_columns(const MaterialStack& finer);

/// Whether the leaf of \p level with first node (\p x, \p y) has nodes of a cell in which the level counts.
/// \param finer  the next finer level, or null.
bool counts_in(const MaterialStack& level, const MaterialStack* finer, int x, int y);

/// The level that counts at a world point.
const MaterialStack& level_at(const MaterialStack& stack, const Vec3& point);

/// The last \p count layers of a stack, on all its levels; they share their grids with it.
MaterialStack upper_layers(const MaterialStack& stack, std::ptrdiff_t count);

/// Active voxels of all layers that each level holds, the finest first.
std::vector<std::size_t> voxels_by_level(const MaterialStack& stack);

}  // namespace sidewall::levelset
