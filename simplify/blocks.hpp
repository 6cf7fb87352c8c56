#pragma once
#include <cstdint>
#include <vector>

#include "simplify/collapse_mesh.hpp"

namespace sidewall::simplify {

/// Parts of a mesh in which edges collapse independently of each other. Vertices between blocks are the seams, left
/// for a pass over the whole mesh.
struct Blocks {
    static constexpr std::uint32_t kSeam = 0xffffffffu;
    std::uint32_t count = 0;
    std::vector<std::uint32_t> of;     ///< per vertex: its block, or kSeam if a neighbour is in another one
    std::vector<std::uint32_t> first;  ///< per block: where its vertices begin in `vertices`, count + 1 long
    std::vector<std::uint32_t> vertices;  ///< block by block, ascending; those in no block left out
};

/// Cuts the mesh along axis-parallel planes into blocks of about as many vertices each. A collapse inside a
/// block touches nothing that one in another block reads. The cuts depend on the mesh alone, never on
/// the number of threads. No blocks for a mesh too small to be worth it.
Blocks make_blocks(const CollapseMesh& mesh);

}  // namespace sidewall::simplify
