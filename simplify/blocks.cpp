#include "simplify/blocks.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace sidewall::simplify {
namespace {

// Smaller blocks have more of their vertices on seams; with larger ones, meshes of some ten thousand vertices
// would not keep all threads busy.
constexpr std::size_t kBlockVertices = 6000;
constexpr int kMostCuts = 10;

struct Cut {
    int axis = 0;
    double at = 0.0;
};

/// Medians of a sample, one level of the tree after another: node i has children 2 i + 1 and 2 i + 2.
void cut(std::vector<Cut>& tree, std::size_t node, std::vector<Vec3>::iterator begin,
         std::vector<Vec3>::iterator end) {
    if (node >= tree.size()) return;
    Box3 box;
    for (auto p = begin; p != end; ++p) box.extend(*p);
    int axis = 0;
    if (begin != end) box.size().maxCoeff(&axis);
    const auto middle = begin + (end - begin) / 2;
    const auto less = [axis](const Vec3& p, const Vec3& q) { return p[axis] < q[axis]; };
    if (begin != end) std::nth_element(begin, middle, end, less);
    tree[node] = {axis, middle != end ? (*middle)[axis] : 0.0};
    cut(tree, 2 * node + 1, begin, middle);
    cut(tree, 2 * node + 2, middle, end);
}

}  // namespace

Blocks make_blocks(const CollapseMesh& mesh) {
    const auto n = static_cast<std::uint32_t>(mesh.leaving.size());
    std::uint32_t used = 0;
    for (const std::uint32_t h : mesh.leaving) used += h != kNoHalfedge;
    int cuts = 0;
    while (cuts < kMostCuts && (used >> (cuts + 1)) >= kBlockVertices) ++cuts;
    Blocks blocks;
    if (cuts == 0) return blocks;
    blocks.count = 1u << cuts;

    std::vector<Vec3> sample;
    const std::uint32_t stride = std::max(1u, used / (256u * blocks.count));
    std::uint32_t at = 0;
    for (std::uint32_t v = 0; v < n; ++v)
        if (mesh.leaving[v] != kNoHalfedge && at++ % stride == 0) sample.push_back(mesh.position(v));
    std::vector<Cut> tree(blocks.count - 1);
    cut(tree, 0, sample.begin(), sample.end());

    std::vector<std::uint32_t> block(n, Blocks::kSeam);
    tbb::parallel_for(std::uint32_t{0}, n, [&](std::uint32_t v) {
        if (mesh.leaving[v] == kNoHalfedge) return;
        std::size_t node = 0;
        while (node < tree.size()) {
            const Cut& c = tree[node];
            node = 2 * node + (mesh.position(v)[c.axis] < c.at ? 1 : 2);
        }
        block[v] = static_cast<std::uint32_t>(node - tree.size());
    });
    blocks.of = block;
    tbb::parallel_for(std::uint32_t{0}, n, [&](std::uint32_t v) {
        const std::uint32_t first = mesh.leaving[v];
        if (first == kNoHalfedge) return;
        std::uint32_t h = first, last = 0;
        bool inside = true;
        do {
            inside &= block[mesh.end(h)] == block[v];
            last = CollapseMesh::previous(h);
            h = mesh.opposite[last];
        } while (h != kNoHalfedge && h != first);
        inside &= block[mesh.start(last)] == block[v];
        if (!inside) blocks.of[v] = Blocks::kSeam;
    });
    blocks.first.assign(blocks.count + 1, 0);
    for (const std::uint32_t b : blocks.of)
        if (b != Blocks::kSeam) ++blocks.first[b + 1];
    for (std::uint32_t b = 0; b < blocks.count; ++b) blocks.first[b + 1] += blocks.first[b];
    blocks.vertices.resize(blocks.first.back());
    std::vector<std::uint32_t> next(blocks.first.begin(), blocks.first.end() - 1);
    for (std::uint32_t v = 0; v < n; ++v)
        if (blocks.of[v] != Blocks::kSeam) blocks.vertices[next[blocks.of[v]]++] = v;
    return blocks;
}

}  // namespace sidewall::simplify
