#include <algorithm>
#include <bit>
#include <cmath>
#include <span>

#include "simplify/collapse_impl.hpp"
#include "surface/infinity.hpp"

namespace sidewall::simplify {
namespace {

constexpr int kTwice = 8;  // buckets an eighth of a power of two wide

}  // namespace

bool CollapseEngine::Impl::allows(std::uint32_t h, std::uint32_t zone) const {
    const std::uint32_t v0 = mesh.start(h), v1 = mesh.end(h);
    if (zone != CollapseWorker::kAnywhere && (blocks.of[v0] != zone || blocks.of[v1] != zone)) return false;
    const VertexState &s = mesh.state[v0], &e = mesh.state[v1];
    if (pass.keep_region && ((s.flags | e.flags) & kRegion)) return false;
    if (s.degree > OneRing::kMost || e.degree > OneRing::kMost) return false;
    if (mesh.merged_place(h) == MergedPlace::nowhere) return false;
    const double length2 = (mesh.position(v1) - mesh.position(v0)).squaredNorm();
    if (!(length2 < max_length2)) return false;
    double most = kInfinity;
    if (!max_length_at[0].empty())
        most = pass.length_factor * std::min(max_length_at[0][v0], max_length_at[0][v1]);
    if (!max_length_at[1].empty())
        most = std::min<double>(most, std::min(max_length_at[1][v0], max_length_at[1][v1]));
    return length2 < most * most;
}

void CollapseEngine::Impl::update(CollapseWorker& worker, std::uint32_t h) const {
    const std::uint32_t edge = mesh.edge(h);
    if (allows(edge, worker.zone))
        worker.queue.push(edge, BucketQueue::bucket_of(edge_cost(mesh, edge, weights).cost));
    else
        worker.queue.remove(edge);
}

bool CollapseEngine::Impl::within_bound(std::uint32_t h, const Vec3& place, Surroundings& s) const {
    return !deviation ||
           deviation->within(max_error, mesh, mesh.start(h), mesh.end(h), place,
                             std::span(s.moved).first(s.count), std::span(s.gone).first(s.apexes), s.plan);
}

bool CollapseEngine::Impl::defer(CollapseWorker& worker, std::uint32_t edge, const Candidate& candidate,
                                 BucketQueue::Bucket bucket) {
    if (deviation || !pass.defer_outliers) return false;
    const std::uint32_t v0 = mesh.start(edge), v1 = mesh.end(edge);
    const double distance2 = candidate.area2 > 0.0 ? candidate.swept / candidate.area2 : 0.0;
    worker.distances.add(distance2);
    const double limit2 = worker.distances.limit2();
    const Witness farther =
        farther_witness(mesh, candidate.place, std::span(worker.around.moved).first(worker.around.count),
                        witness[v0], witness[v1], 0.25 * limit2);
    if (farther.distance2 > limit2 && bucket + kTwice <= BucketQueue::kLast) {
        worker.queue.push(edge, static_cast<BucketQueue::Bucket>(bucket + kTwice));
        return true;
    }
    witness[v0] = farther.point;
    return false;
}

bool CollapseEngine::Impl::wait(CollapseWorker& worker, std::uint32_t edge, BucketQueue::Bucket now,
                                BucketQueue::Bucket bucket) const {
    constexpr std::size_t kMany = 2048;
    if (!deviation) return false;
    const Surroundings& s = worker.around;
    const std::size_t points =
        deviation->points_at(std::span(s.moved).first(s.count), std::span(s.gone).first(s.apexes));
    const int later = now + kTwice * static_cast<int>(std::bit_width(points / kMany));
    if (bucket >= later || later > BucketQueue::kLast) return false;
    worker.queue.push(edge, static_cast<BucketQueue::Bucket>(later));
    return true;
}

void CollapseEngine::Impl::collapse(std::uint32_t h, const Vec3& place, const Surroundings& s) {
    const std::uint32_t v0 = mesh.start(h), v1 = mesh.end(h);
    source[v0] = place == mesh.position(v0) ? source[v0] : place == mesh.position(v1) ? source[v1] : kMoved;
    if (deviation)
        deviation->apply(v0, std::span(s.moved).first(s.count), std::span(s.gone).first(s.apexes), s.plan);
    for (std::vector<float>& lengths : max_length_at)
        if (!lengths.empty()) lengths[v0] = std::min(lengths[v0], lengths[v1]);
    collapse_edge(mesh, h, place, s);
}

bool CollapseEngine::Impl::refused_too_many(const CollapseWorker& worker, std::size_t removed) const {
    constexpr std::size_t kFew = 200;  // too few to judge by
    return pass.stop_when_refused && worker.refused > worker.removed + removed + kFew;
}

std::size_t CollapseEngine::Impl::work(CollapseWorker& worker, BucketQueue::Bucket limit, std::size_t quota) {
    std::size_t removed = 0;
    std::uint32_t edge = 0;
    BucketQueue::Bucket bucket = 0;
    if (refused_too_many(worker, 0)) return 0;
    while (removed < quota && worker.queue.pop(limit, edge, bucket)) {
        if (mesh.removed(edge) || !mesh.is_edge(edge) || !allows(edge, worker.zone)) continue;
        const Candidate candidate = edge_cost(mesh, edge, weights);
        if (!std::isfinite(candidate.cost)) continue;
        const BucketQueue::Bucket now = BucketQueue::bucket_of(candidate.cost);
        if (now > bucket) {
            worker.queue.push(edge, now);
            continue;
        }
        if (!can_collapse(mesh, edge, candidate.place, worker.around)) continue;
        if (wait(worker, edge, now, bucket)) continue;
        if (!within_bound(edge, candidate.place, worker.around)) {
            ++worker.refused;
            if (refused_too_many(worker, removed)) break;
            continue;
        }
        if (defer(worker, edge, candidate, bucket)) continue;
        const std::uint32_t kept = mesh.start(edge);
        collapse(edge, candidate.place, worker.around);
        ++removed;
        constexpr std::size_t kReport = 1024;
        if (progress && removed % kReport == 0) report(kReport);
        OneRing& ring = worker.around.start;
        mesh.ring(kept, ring);
        for (std::uint32_t i = 0; i < ring.triangles; ++i) update(worker, ring.out[i]);
        if (ring.size > ring.triangles) update(worker, CollapseMesh::previous(ring.out[ring.triangles - 1]));
    }
    worker.removed += removed;
    return removed;
}

void CollapseEngine::Impl::report(std::size_t removed) {
    const std::size_t left = reported -= removed;
    if (!reporting.try_lock()) return;
    progress(left);
    reporting.unlock();
}

}  // namespace sidewall::simplify
