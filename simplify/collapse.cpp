#include "simplify/collapse.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "surface/error.hpp"

namespace sidewall::simplify {
namespace {

constexpr std::size_t kEveryVertex = std::numeric_limits<std::size_t>::max();
// Least number of vertices a block. Smaller blocks have more of their vertices on seams; with larger ones,
// meshes of some ten thousand vertices would not keep all threads busy.
constexpr std::size_t kBlockVertices = 6000;
constexpr int kMostCuts = 10;
/// Block index of a vertex on a seam: one with a neighbour in another block.
constexpr std::uint32_t kSeam = 0xffffffffu;

/// Vertices of each block, ascending. Edges of different blocks collapse independently of each other.
/// Vertices on seams belong to no block and are left for run_everywhere().
using Blocks = std::vector<std::vector<std::uint32_t>>;

/// Plane coordinate[axis] = at.
struct Cut {
    int axis = 0;
    double at = 0.0;
};

/// Fills a k-d tree with cuts at the medians of the points; node i has children 2 i + 1 and 2 i + 2.
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

/// Cuts the mesh along axis-parallel planes into blocks of about equally many vertices. A collapse inside a
/// block writes nothing that a collapse in another block reads. The cuts depend on the mesh alone, not on the
/// number of threads. A mesh of fewer than 2 kBlockVertices vertices gets no blocks.
/// \param of  receives the block of each vertex, or kSeam.
Blocks make_blocks(const CollapseMesh& mesh, std::vector<std::uint32_t>& of) {
    const auto n = static_cast<std::uint32_t>(mesh.leaving.size());
    std::uint32_t used = 0;
    for (const std::uint32_t h : mesh.leaving) used += h != kNoHalfedge;
    int cuts = 0;
    while (cuts < kMostCuts && (used >> (cuts + 1)) >= kBlockVertices) ++cuts;
    if (cuts == 0) return {};
    Blocks blocks(std::size_t{1} << cuts);
    const auto count = static_cast<std::uint32_t>(blocks.size());

    std::vector<Vec3> sample;
    const std::uint32_t stride = std::max(1u, used / (256u * count));
    std::uint32_t at = 0;
    for (std::uint32_t v = 0; v < n; ++v)
        if (mesh.leaving[v] != kNoHalfedge && at++ % stride == 0) sample.push_back(mesh.position(v));
    std::vector<Cut> tree(count - 1);
    cut(tree, 0, sample.begin(), sample.end());

    std::vector<std::uint32_t> block(n, kSeam);
    tbb::parallel_for(std::uint32_t{0}, n, [&](std::uint32_t v) {
        if (mesh.leaving[v] == kNoHalfedge) return;
        std::size_t node = 0;
        while (node < tree.size()) {
            const Cut& c = tree[node];
            node = 2 * node + (mesh.position(v)[c.axis] < c.at ? 1 : 2);
        }
        block[v] = static_cast<std::uint32_t>(node - tree.size());
    });
    of = block;
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
        if (!inside) of[v] = kSeam;
    });
    for (std::uint32_t v = 0; v < n; ++v)
        if (of[v] != kSeam) blocks[of[v]].push_back(v);
    return blocks;
}

/// Queues the edges of a worker's block that may collapse.
void fill(const CollapseState& state, const Blocks& blocks, CollapseWorker& worker) {
    const CollapseMesh& mesh = state.mesh;
    for (const std::uint32_t v : blocks[worker.zone]) {
        const std::uint32_t first = mesh.leaving[v];
        std::uint32_t h = first;
        do {
            if (mesh.is_edge(h)) worker.queue.push(h, queue_bucket(state, h, worker.zone));
            h = mesh.opposite[CollapseMesh::previous(h)];
        } while (h != kNoHalfedge && h != first);
    }
}

/// Collapses edges in all blocks up to a common cost, below which twice as many edges are queued as vertices
/// wanted: a collapse removes up to three edges. Each block collapses at most half of its queued edges.
/// \returns how many vertices it removed.
std::size_t run_round(CollapseState& state, std::vector<CollapseWorker>& workers, std::size_t wanted) {
    BucketQueue::Bucket limit = 0;
    std::size_t queued = 0;
    for (BucketQueue::Bucket b = 0; b <= BucketQueue::kLast; ++b) {
        std::size_t more = 0;
        for (const CollapseWorker& worker : workers) more += worker.queue.size(b);
        if (queued > 0 && queued + more > 2 * wanted) break;
        queued += more;
        limit = b;
    }
    std::vector<std::size_t> removed(workers.size(), 0);
    const double part =
        std::min(0.5, static_cast<double>(wanted) / static_cast<double>(std::max<std::size_t>(queued, 1)));
    tbb::parallel_for(
        std::size_t{0}, workers.size(),
        [&](std::size_t i) {
            std::size_t own = 0;
            for (BucketQueue::Bucket b = 0; b <= limit; ++b) own += workers[i].queue.size(b);
            const auto quota = static_cast<std::size_t>(part * static_cast<double>(own));
            removed[i] = collapse_queued(state, workers[i], limit, quota);
        },
        tbb::simple_partitioner{});
    return std::accumulate(removed.begin(), removed.end(), std::size_t{0});
}

/// Calls \p visit for each edge, with the halfedge that stands for it.
template <class Visit>
void each_edge(const CollapseMesh& mesh, const Visit& visit) {
    for (std::uint32_t h = 0; h < mesh.corner.size(); ++h)
        if (!mesh.removed(h) && mesh.is_edge(h)) visit(h);
}

}  // namespace

CollapseEngine::CollapseEngine(const TriangleMesh& mesh, const Options& options)
    : input_(mesh),
      state_{.mesh = CollapseMesh(mesh),
             .weights = options.weights.value_or(kVolumeWeights),
             .progress = options.progress} {
    const std::size_t n = input_.vertices.size();
    const CollapseMesh& m = state_.mesh;
    for (const std::uint32_t h : m.leaving) vertices_ += h != kNoHalfedge;
    const std::vector<std::uint8_t> frozen = frozen_vertices(input_, options.fixed);
    for (std::size_t v = 0; v < n; ++v)
        if (frozen[v]) state_.mesh.state[v].constraint.kind = VertexKind::frozen;
    state_.source.resize(n);
    std::iota(state_.source.begin(), state_.source.end(), 0u);
    state_.witness.resize(n);
    for (std::uint32_t v = 0; v < n; ++v) state_.witness[v] = m.position(v);
    where_.assign(m.corner.size(), BucketQueue::kNone);
}

void CollapseEngine::set_features(std::span<const std::uint8_t> features) {
    const std::size_t n = input_.vertices.size();
    if (features.size() != n)
        throw GeometryError("{} feature flags for {} vertices: give one a vertex", features.size(), n);
    for (std::size_t v = 0; v < n; ++v) {
        std::uint8_t& flags = state_.mesh.state[v].flags;
        flags = static_cast<std::uint8_t>((flags & ~kFeature) | (features[v] != 0 ? kFeature : 0));
    }
    reset_region();
}

void CollapseEngine::set_max_lengths(std::span<const double> graded, std::span<const double> fixed) {
    const std::size_t n = input_.vertices.size();
    for (std::size_t which = 0; which < 2; ++which) {
        const std::span<const double> lengths = which == 0 ? graded : fixed;
        if (lengths.size() != n && !lengths.empty())
            throw GeometryError("{} edge lengths for {} vertices: give one a vertex", lengths.size(), n);
        state_.max_length_at[which].clear();
        for (const double length : lengths)
            state_.max_length_at[which].push_back(static_cast<float>(length * state_.mesh.scale));
    }
}

void CollapseEngine::reset_region() {
    for (VertexState& state : state_.mesh.state)
        state.flags =
            static_cast<std::uint8_t>((state.flags & ~kRegion) | (state.flags & kFeature ? kRegion : 0));
}

std::size_t CollapseEngine::grow_region() {
    CollapseMesh& mesh = state_.mesh;
    std::vector<std::uint32_t> joins;
    each_edge(mesh, [&](std::uint32_t h) {
        const std::uint32_t a = mesh.start(h), b = mesh.end(h);
        if (mesh.flagged(a, kRegion) != mesh.flagged(b, kRegion))
            joins.push_back(mesh.flagged(a, kRegion) ? b : a);
    });
    std::size_t added = 0;
    for (const std::uint32_t v : joins) {
        added += !mesh.flagged(v, kRegion);
        mesh.state[v].flags |= kRegion;
    }
    return added;
}

std::size_t CollapseEngine::run(const CollapsePass& pass) {
    const std::size_t before = vertices_;
    if (before <= pass.target_vertices) return 0;
    const CollapseMesh& mesh = state_.mesh;
    state_.pass = pass;
    state_.max_length2 = pass.max_length * mesh.scale * pass.max_length * mesh.scale;
    state_.max_error = pass.max_error * mesh.scale;
    if (std::isfinite(state_.max_error) && !state_.deviation) state_.deviation.emplace(mesh);
    state_.reported = vertices_;
    run_blocks(vertices_ - pass.target_vertices);
    run_everywhere();
    return before - vertices_;
}

void CollapseEngine::run_blocks(std::size_t excess) {
    const Blocks blocks = make_blocks(state_.mesh, state_.block);
    if (blocks.empty()) return;
    std::vector<CollapseWorker> workers;
    workers.reserve(blocks.size());
    std::size_t inside = 0;
    for (const std::vector<std::uint32_t>& block : blocks) {
        workers.push_back({BucketQueue(where_), static_cast<std::uint32_t>(workers.size()), distances_});
        inside += block.size();
    }
    tbb::parallel_for(
        std::size_t{0}, blocks.size(), [&](std::size_t b) { fill(state_, blocks, workers[b]); },
        tbb::simple_partitioner{});
    if (state_.pass.target_vertices == 0) {
        tbb::parallel_for(
            std::size_t{0}, blocks.size(),
            [&](std::size_t b) { collapse_queued(state_, workers[b], BucketQueue::kLast, kEveryVertex); },
            tbb::simple_partitioner{});
    } else {
        // The blocks' share of the excess, less 3 %. The seams' share is left for run_everywhere().
        const double share = static_cast<double>(inside) / static_cast<double>(vertices_);
        const auto wanted = static_cast<std::size_t>(0.97 * share * static_cast<double>(excess));
        constexpr int kMostRounds = 16;
        std::size_t removed = 0;
        for (int round = 0; round < kMostRounds && removed < wanted; ++round) {
            const std::size_t now = run_round(state_, workers, wanted - removed);
            if (now == 0) break;
            removed += now;
        }
    }
    distances_ = {};
    for (const CollapseWorker& worker : workers) {
        vertices_ -= worker.removed;
        distances_.mean2 += worker.distances.count * worker.distances.mean2;
        distances_.count += worker.distances.count;
    }
    if (distances_.count > 0.0) distances_.mean2 /= distances_.count;
    std::fill(where_.begin(), where_.end(), BucketQueue::kNone);
}

void CollapseEngine::run_everywhere() {
    constexpr int kMostSweeps = 20;
    const CollapseMesh& mesh = state_.mesh;
    const std::size_t target = state_.pass.target_vertices;
    std::vector<BucketQueue::Bucket> bucket(mesh.corner.size());
    for (int sweep = 0; sweep < kMostSweeps && vertices_ > target; ++sweep) {
        tbb::parallel_for(std::size_t{0}, bucket.size(), [&](std::size_t i) {
            const auto h = static_cast<std::uint32_t>(i);
            bucket[i] = mesh.removed(h) || !mesh.is_edge(h)
                            ? BucketQueue::kNone
                            : queue_bucket(state_, h, CollapseWorker::kAnywhere);
        });
        CollapseWorker worker{BucketQueue(where_), CollapseWorker::kAnywhere, distances_};
        for (std::uint32_t h = 0; h < bucket.size(); ++h) worker.queue.push(h, bucket[h]);
        const std::size_t removed = collapse_queued(state_, worker, BucketQueue::kLast, vertices_ - target);
        vertices_ -= removed;
        distances_ = worker.distances;
        std::fill(where_.begin(), where_.end(), BucketQueue::kNone);
        // Without a target, a sweep that removes less than a thousandth of the vertices is the last one.
        const bool little = removed * 1000 <= vertices_;
        if (removed == 0 || (little && target == 0) || refused_too_many(state_, worker)) break;
    }
}

std::pair<double, double> CollapseEngine::transition_edges() const {
    const CollapseMesh& mesh = state_.mesh;
    const auto held = [&](std::uint32_t v) {
        return mesh.state[v].constraint.kind == VertexKind::frozen || mesh.flagged(v, kRegion);
    };
    double shortest = kInfinity, longest = 0.0;
    each_edge(mesh, [&](std::uint32_t h) {
        if (held(mesh.start(h)) || held(mesh.end(h))) return;
        const double length = (mesh.position(mesh.end(h)) - mesh.position(mesh.start(h))).norm() / mesh.scale;
        shortest = std::min(shortest, length);
        longest = std::max(longest, length);
    });
    return {shortest, longest};
}

TriangleMesh CollapseEngine::take_mesh() const {
    const CollapseMesh& mesh = state_.mesh;
    const Box3 box = bounding_box(input_);
    return assemble(input_, mesh.corner, [&](std::uint32_t v) {
        if (state_.source[v] != CollapseState::kMoved) return input_.vertices[state_.source[v]];
        // Adding the centre back rounds: put the vertex back into the box and its side planes.
        Vec3 p = mesh.to_world(mesh.position(v)).cwiseMax(box.min).cwiseMin(box.max);
        move_into(mesh.state[v].constraint.planes, p, box.min, box.max);
        return p;
    });
}

}  // namespace sidewall::simplify
