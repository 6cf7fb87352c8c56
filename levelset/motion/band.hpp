#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "levelset/domain.hpp"
#include "levelset/openvdb_grid.hpp"
#include "surface/extraction/leaf_table.hpp"

namespace sidewall::levelset {

/// A grid's leaves in its own order, and those of them that a re-distancing may change.
///
/// Re-distancing is a function of a leaf's voxels and of those up to 4 nodes around. A leaf is at rest where it once
/// gave back the very voxels it was given, and none of them nor of the leaves around has changed since; then it
/// would do so again, and nothing needs to be done. A leaf's fingerprint tells whether its voxels have changed.
struct Band {
    std::vector<Leaf*> leaves;
    surface::LeafTable table;  ///< of the leaves
    std::vector<std::uint32_t>
        print;  ///< fingerprints of the leaves as found; 0 of those changed or made since
    std::vector<std::uint32_t> awake;  ///< numbers of the leaves that are not at rest, ascending
    std::vector<std::uint8_t> made;    ///< by leaf: it was made by growing the band, and has no distance yet

    Band() = default;
    /// \param all      the grid's leaves.
    /// \param of_all   their table.
    /// \param changed  by leaf: known to have changed since the last re-distancing, which saves looking. Empty: of none.
    Band(std::vector<Leaf*> all, surface::LeafTable of_all, const Domain& domain,
         std::span<const std::uint8_t> changed);
};

/// Of a leaf's values and active voxels, never 0. A leaf keeps that of the voxels with which it came to rest as OpenVDB's
/// transient data, which no file holds.
std::uint32_t fingerprint(const Leaf& leaf);

/// Marks by leaf: those of \p marked and all whose re-distancing reads one of them, across the domain's sides, too.
std::vector<std::uint8_t> with_readers(const Band& band, const Domain& domain,
                                       const std::vector<std::uint8_t>& marked);

/// Activates the face neighbours of the awake leaves' voxels, across a periodic side too, within the domain.
void grow(Band& band, Grid& grid, const Domain& domain);

}  // namespace sidewall::levelset
