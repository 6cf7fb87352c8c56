#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "simplify/collapse_impl.hpp"

namespace sidewall::simplify {
namespace {

constexpr std::size_t kEveryVertex = std::numeric_limits<std::size_t>::max();

}  // namespace

void CollapseEngine::Impl::fill(CollapseWorker& worker) {
    const std::uint32_t* begin = blocks.vertices.data() + blocks.first[worker.zone];
    const std::uint32_t* end = blocks.vertices.data() + blocks.first[worker.zone + 1];
    for (const std::uint32_t* v = begin; v != end; ++v) {
        const std::uint32_t first = mesh.leaving[*v];
        std::uint32_t h = first;
        do {
            if (mesh.is_edge(h)) update(worker, h);
            h = mesh.opposite[CollapseMesh::previous(h)];
        } while (h != kNoHalfedge && h != first);
    }
}

std::size_t CollapseEngine::Impl::run_blocks(std::size_t excess) {
    blocks = make_blocks(mesh);
    if (blocks.count == 0) return 0;
    std::vector<CollapseWorker> workers;
    workers.reserve(blocks.count);
    for (std::uint32_t b = 0; b < blocks.count; ++b) workers.emplace_back(where, b, distances);
    tbb::parallel_for(
        std::uint32_t{0}, blocks.count, [&](std::uint32_t b) { fill(workers[b]); },
        tbb::simple_partitioner{});
    if (pass.target_vertices == 0) {
        tbb::parallel_for(
            std::uint32_t{0}, blocks.count,
            [&](std::uint32_t b) { work(workers[b], BucketQueue::kLast, kEveryVertex); },
            tbb::simple_partitioner{});
    } else {
        // The seams' share is left for later, at the same cost.
        const double share = static_cast<double>(blocks.vertices.size()) / static_cast<double>(vertices);
        const auto wanted = static_cast<std::size_t>(0.97 * share * static_cast<double>(excess));
        constexpr int kMostRounds = 16;
        std::size_t removed = 0;
        for (int round = 0; round < kMostRounds && removed < wanted; ++round) {
            const std::size_t now = run_round(workers, wanted - removed);
            if (now == 0) break;
            removed += now;
        }
    }
    std::size_t removed = 0;
    for (const CollapseWorker& worker : workers) removed += worker.removed;
    distances = {};
    for (const CollapseWorker& worker : workers) {
        distances.mean2 += worker.distances.count * worker.distances.mean2;
        distances.count += worker.distances.count;
    }
    if (distances.count > 0.0) distances.mean2 /= distances.count;
    std::fill(where.begin(), where.end(), BucketQueue::kNone);
    return removed;
}

std::size_t CollapseEngine::Impl::run_round(std::vector<CollapseWorker>& workers, std::size_t wanted) {
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
            removed[i] = work(workers[i], limit, quota);
        },
        tbb::simple_partitioner{});
    return std::accumulate(removed.begin(), removed.end(), std::size_t{0});
}

void CollapseEngine::Impl::run_everywhere() {
    constexpr int kMostSweeps = 20;
    std::vector<BucketQueue::Bucket> bucket(mesh.corner.size());
    for (int sweep = 0; sweep < kMostSweeps && vertices > pass.target_vertices; ++sweep) {
        tbb::parallel_for(std::size_t{0}, bucket.size(), [&](std::size_t i) {
            const auto h = static_cast<std::uint32_t>(i);
            bucket[i] = BucketQueue::kNone;
            if (mesh.removed(h) || !mesh.is_edge(h) || !allows(h, CollapseWorker::kAnywhere)) return;
            const double cost = edge_cost(mesh, h, weights).cost;
            if (std::isfinite(cost)) bucket[i] = BucketQueue::bucket_of(cost);
        });
        CollapseWorker worker(where, CollapseWorker::kAnywhere, distances);
        for (std::uint32_t h = 0; h < bucket.size(); ++h)
            if (bucket[h] != BucketQueue::kNone) worker.queue.push(h, bucket[h]);
        const std::size_t removed = work(worker, BucketQueue::kLast, vertices - pass.target_vertices);
        vertices -= removed;
        distances = worker.distances;
        std::fill(where.begin(), where.end(), BucketQueue::kNone);
        // A sweep that finds next to nothing is the last one, unless there is a target to meet.
        const bool little = removed * 1000 <= vertices;
        if (removed == 0 || (little && pass.target_vertices == 0) || refused_too_many(worker, 0)) break;
    }
}

void CollapseEngine::Impl::run() {
    max_length2 = pass.max_length * mesh.scale * pass.max_length * mesh.scale;
    max_error = pass.max_error * mesh.scale;
    if (std::isfinite(max_error) && !deviation) deviation.emplace(mesh);
    reported = vertices;
    vertices -= run_blocks(vertices - pass.target_vertices);
    run_everywhere();
}

}  // namespace sidewall::simplify
