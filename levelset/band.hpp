#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "levelset/domain.hpp"
#include "levelset/narrow_band.hpp"
#include "levelset/openvdb_grid.hpp"
#include "surface/extraction/leaf_table.hpp"

namespace sidewall::levelset {

/// A grid's leaves in its own order, and those of them that a re-distancing may change.
///
/// Re-distancing is a function of a leaf's voxels and of those up to 4 nodes around. A leaf is at rest where it once
/// came back unchanged, and neither its voxels nor those of the leaves around have changed since; then re-distancing
/// would not change it and skips it. A leaf's fingerprint shows whether its voxels have changed.
struct Band {
    std::vector<Leaf*> leaves;
    surface::LeafTable table;  ///< of the leaves
    std::vector<std::uint32_t>
        print;  ///< fingerprints of the leaves as found; 0 of those changed or made since
    std::vector<std::uint32_t> awake;  ///< numbers of the leaves that are not at rest, ascending
    std::vector<std::uint8_t> made;    ///< by leaf: it was made by growing the band, and has no distance yet

    /// By leaf: nodes whose values stay as they are, as those of a front that the grid does not show yet; empty: none.
    std::vector<Nodes> held = {};

    Band() = default;
    /// \param all      the grid's leaves.
    /// \param of_all   their table.
    /// \param changed  by leaf: known to have changed since the last re-distancing, which saves its fingerprint. Empty: of none.
    Band(std::vector<Leaf*> all, surface::LeafTable of_all, const Domain& domain,
         std::span<const std::uint8_t> changed);
};

/// A 32-bit hash of a leaf's values and active voxels, never 0. A leaf at rest keeps its hash as OpenVDB's transient data,
/// which no file holds.
std::uint32_t fingerprint(const Leaf& leaf);

/// Marks by leaf: those of \p marked and all whose re-distancing reads one of them, across the domain's sides, too.
std::vector<std::uint8_t> with_readers(const Band& band, const Domain& domain,
                                       const std::vector<std::uint8_t>& marked);

/// Activates the face neighbours of the awake leaves' voxels, across a periodic side too, within the domain.
void grow(Band& band, Grid& grid, const Domain& domain);

/// Gives the nodes of leaves that the growing band has made the side of the front that their neighbours lie on, and the
/// value of the band's edge. Until then they hold the value of the tile they replace, whose sign means nothing.
/// \note Parallel; the same bits on any number of threads.
void sign_new_leaves(const Band& band, const Grid& grid, const Domain& domain);

}  // namespace sidewall::levelset
