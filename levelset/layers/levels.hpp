#pragma once
#include <functional>
#include <vector>

#include "levelset/grid.hpp"
#include "levelset/layers/stack.hpp"

/// Levels of a stack: the same materials at the finest spacing, at twice, at four times it. The finest one counts in
/// columns where the wafer has features that a coarser one cannot hold; a level's grids are kept in its own columns
/// and a margin around them, the coarsest one's everywhere. Every level moves by itself, with its margin, but for what
/// lies deep under a finer one and takes its values instead; afterwards levels give each other values: a coarser one
/// takes the finer one's at the nodes they share (injection), and a margin those of the coarser level, interpolated by
/// cubics (prolongation). What a time step or a re-distancing reads lies within the margin.
///
///           | margin | own columns of the finer level  | margin |
///     ------+--------+---------------------------------+--------+------    coarser level, everywhere
///                ^ prolongation      v injection            ^
namespace sidewall::levelset {

/// Twice the spacing on the same box.
/// \pre even numbers of cells along x and y.
Domain coarser_domain(const Domain& domain);

/// Every column of a domain.
LevelColumns all_columns(const Domain& domain);

/// How many levels there are: 1 without coarser ones.
int level_count(const MaterialStack& stack);

/// The most levels, up to 3, that a domain can have: cells along x and y divide, and at least 4 of the coarsest are left.
int most_levels(const Domain& domain);

/// Adds coarser levels to a stack of one, up to \p levels of them; the finest stays as it is where there are features.
/// \pre levels <= most_levels
void make_levels(MaterialStack& stack, int levels, int margin);

/// Samples a stack, always of the same layers, on a domain of any spacing in some columns (levelset/layers/make_stack.hpp).
using StackSampler = std::function<MaterialStack(const Domain& domain, const LeafChoice& where)>;

/// A stack of several levels, each made where it counts and little beyond.
/// \param domain  of the finest level.
/// \pre 2 <= levels <= most_levels
MaterialStack make_levels(const Domain& domain, int levels, int margin, const StackSampler& sample);

/// The stack with its finest level everywhere and no other: what lies in the coarser ones' columns is interpolated.
MaterialStack on_one_level(const MaterialStack& stack);

/// After all levels have moved: injection but for deep_columns, then prolongation.
void exchange_levels(MaterialStack& stack);

/// Chooses the columns of every level anew. A level is to count in a column where the coarser one finds a radius
/// of curvature below kNeeded of its cells in a layer's front, a gap or a piece of material less than four cells
/// thick, or as near to these as the front may come until the next choice (Lenz et al., J. Sci. Comput. 2023,
/// 10.1007/s10915-023-02133-5, refine by curvature, too); or where \p wanted says so. Columns are given up only where
/// radii are above kGivenUp cells.
void choose_columns(MaterialStack& stack, const std::vector<LevelColumns>& wanted);

/// Columns of \p finer under which the next coarser level need not move but takes the values of \p finer: nothing outside
/// of them reads these leaves within a time step. All columns over one coarser leaf have the same flag.
LevelColumns deep_columns(const MaterialStack& finer);

/// Whether a leaf of a level, by its first node, has nodes of a cell in which the level counts.
/// \param finer  the next finer level, or null.
bool counts_in(const MaterialStack& level, const MaterialStack* finer, int x, int y);

/// The level that counts at a world point.
const MaterialStack& level_at(const MaterialStack& stack, const Vec3& point);

/// The last \p count layers of a stack, on all its levels; they share their grids with it.
MaterialStack upper_layers(const MaterialStack& stack, std::ptrdiff_t count);

/// Active voxels of all layers that each level holds, the finest first.
std::vector<std::size_t> voxels_by_level(const MaterialStack& stack);

}  // namespace sidewall::levelset
