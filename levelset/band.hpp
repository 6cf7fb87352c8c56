#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "levelset/domain.hpp"
#include "levelset/narrow_band.hpp"
#include "levelset/openvdb_grid.hpp"
#include "surface/extraction/leaf_table.hpp"

namespace sidewall::levelset {

/// The leaves of a grid's narrow band, and those among them that a re-distancing has to process.
///
/// Re-distancing a leaf reads voxels up to 4 nodes away. A leaf is at rest if its last re-distancing left it
/// unchanged and no voxel in it or in the leaves around has changed since, which fingerprints show. It is
/// then skipped, because another re-distancing would not change it either.
struct Band {
    std::vector<Leaf*> leaves;  ///< in the tree's order
    surface::LeafTable table;   ///< finds a leaf's number by its coordinates
    std::vector<std::uint32_t>
        print;  ///< fingerprints when the band was made; 0: leaf known to have changed, or made by grow()
    std::vector<std::uint32_t> awake;  ///< numbers of the leaves that are not at rest, ascending
    std::vector<std::uint8_t> made;    ///< by leaf: made by grow(), without distances yet

    /// By leaf: nodes that keep their values, e.g. near a front that the grid does not show yet; empty: none.
    std::vector<Nodes> held = {};

    Band() = default;
    /// \param all      the grid's leaves.
    /// \param of_all   their table.
    /// \param changed  by leaf: known to have changed since the last re-distancing, so that no fingerprint is
    ///                 computed; empty: none is known to.
    Band(std::vector<Leaf*> all, surface::LeafTable of_all, const Domain& domain,
         std::span<const std::uint8_t> changed);
};

/// A 32-bit hash of a leaf's values and active voxels, never 0. A leaf at rest stores its hash as OpenVDB's
/// transient data, which is not written to files.
std::uint32_t fingerprint(const Leaf& leaf);

/// Flags by leaf: \p marked ones and all whose re-distancing reads one, also across the domain's sides.
std::vector<std::uint8_t> with_readers(const Band& band, const Domain& domain,
                                       const std::vector<std::uint8_t>& marked);

/// Activates the face neighbours of the awake leaves' voxels, across a periodic side too, within the domain.
void grow(Band& band, Grid& grid, const Domain& domain);

/// Sets the nodes of leaves that grow() has made to the value at the band's edge, with the sign of their
/// neighbours in the old band. Before, they hold a tile's value, whose sign means nothing.
/// \note Parallel; the same bits on any number of threads.
void sign_new_leaves(const Band& band, const Grid& grid, const Domain& domain);

}  // namespace sidewall::levelset
