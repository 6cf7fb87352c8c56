#include "simplify/collapse_worker.hpp"

#include <cmath>

#include "simplify/edge_cost.hpp"

namespace sidewall::simplify {
namespace {

constexpr int kTwice = 8;  // buckets from a cost to twice that cost

/// Whether zone, region, degrees, constraints and length allow an edge to collapse in this pass.
bool may_collapse(const CollapseState& state, std::uint32_t h, std::uint32_t zone) {
    const CollapseMesh& mesh = state.mesh;
    const std::uint32_t v0 = mesh.start(h), v1 = mesh.end(h);
    if (zone != CollapseWorker::kAnywhere && (state.block[v0] != zone || state.block[v1] != zone))
        return false;
    const VertexState &s = mesh.state[v0], &e = mesh.state[v1];
    if (state.pass.keep_region && ((s.flags | e.flags) & kRegion)) return false;
    if (s.degree > OneRing::kMost || e.degree > OneRing::kMost) return false;
    if (mesh.merged_place(h) == MergedPlace::nowhere) return false;
    const double length2 = (mesh.position(v1) - mesh.position(v0)).squaredNorm();
    if (!(length2 < state.max_length2)) return false;
    double most = kInfinity;
    const auto& [graded, fixed] = state.max_length_at;
    if (!graded.empty()) most = state.pass.length_factor * std::min(graded[v0], graded[v1]);
    if (!fixed.empty()) most = std::min<double>(most, std::min(fixed[v0], fixed[v1]));
    return length2 < most * most;
}

/// Queues an edge again at twice its cost if its collapse would leave a witness far from the surface; else
/// gives its start the farther witness of both ends. Only with defer_outliers, and without an error bound.
/// \returns whether the edge is queued again.
bool defer(CollapseState& state, CollapseWorker& worker, std::uint32_t edge, const Candidate& candidate,
           BucketQueue::Bucket bucket) {
    if (state.deviation || !state.pass.defer_outliers) return false;
    const std::uint32_t v0 = state.mesh.start(edge), v1 = state.mesh.end(edge);
    const double distance2 = candidate.area2 > 0.0 ? candidate.swept / candidate.area2 : 0.0;
    worker.distances.add(distance2);
    const double limit2 = worker.distances.limit2();
    const Witness farther = farther_witness(state.mesh, candidate.place, worker.around.triangles_moved(),
                                            state.witness[v0], state.witness[v1], 0.25 * limit2);
    if (farther.distance2 > limit2 && bucket + kTwice <= BucketQueue::kLast) {
        worker.queue.push(edge, static_cast<BucketQueue::Bucket>(bucket + kTwice));
        return true;
    }
    state.witness[v0] = farther.point;
    return false;
}

/// If the error is bounded and over 2047 points of the original belong to the triangles around an edge,
/// queues it again at a cost that doubles with their number. Otherwise one vertex of a flat region would
/// absorb its neighbours one by one, and each collapse would measure all these points.
/// \returns whether the edge is queued again.
bool wait(const CollapseState& state, CollapseWorker& worker, std::uint32_t edge, BucketQueue::Bucket now,
          BucketQueue::Bucket bucket) {
    constexpr std::size_t kMany = 2048;
    if (!state.deviation) return false;
    const std::size_t points =
        state.deviation->points_at(worker.around.triangles_moved(), worker.around.triangles_gone());
    const int later = now + kTwice * static_cast<int>(std::bit_width(points / kMany));
    if (bucket >= later || later > BucketQueue::kLast) return false;
    worker.queue.push(edge, static_cast<BucketQueue::Bucket>(later));
    return true;
}

/// Whether the collapse keeps to the error bound.
/// \pre can_collapse() has filled in \p s.
bool within_bound(const CollapseState& state, std::uint32_t h, const Vec3& place, Surroundings& s) {
    return !state.deviation ||
           state.deviation->within(state.max_error, state.mesh, state.mesh.start(h), state.mesh.end(h), place,
                                   s.triangles_moved(), s.triangles_gone(), s.plan);
}

/// Collapses an edge that has passed can_collapse() and within_bound().
void collapse(CollapseState& state, std::uint32_t h, const Vec3& place, const Surroundings& s) {
    CollapseMesh& mesh = state.mesh;
    const std::uint32_t v0 = mesh.start(h), v1 = mesh.end(h);
    if (place != mesh.position(v0))
        state.source[v0] = place == mesh.position(v1) ? state.source[v1] : CollapseState::kMoved;
    if (state.deviation) state.deviation->apply(v0, s.triangles_moved(), s.triangles_gone(), s.plan);
    for (std::vector<float>& lengths : state.max_length_at)
        if (!lengths.empty()) lengths[v0] = std::min(lengths[v0], lengths[v1]);
    collapse_edge(mesh, h, place, s);
}

/// Reports how many vertices are left, unless another thread is reporting at the moment.
void report(CollapseState& state, std::size_t removed) {
    const std::size_t left = state.reported -= removed;
    if (!state.reporting.try_lock()) return;
    state.progress(left);
    state.reporting.unlock();
}

/// Queues the edges around a vertex at their present costs.
void queue_around(const CollapseState& state, CollapseWorker& worker, std::uint32_t vertex) {
    OneRing& ring = worker.around.start;
    state.mesh.ring(vertex, ring);
    const auto queue = [&](std::uint32_t h) {
        const std::uint32_t edge = state.mesh.edge(h);
        worker.queue.push(edge, queue_bucket(state, edge, worker.zone));
    };
    for (std::uint32_t i = 0; i < ring.triangles; ++i) queue(ring.out[i]);
    if (ring.size > ring.triangles) queue(CollapseMesh::previous(ring.out[ring.triangles - 1]));
}

}  // namespace

BucketQueue::Bucket queue_bucket(const CollapseState& state, std::uint32_t edge, std::uint32_t zone) {
    if (!may_collapse(state, edge, zone)) return BucketQueue::kNone;
    const double cost = edge_cost(state.mesh, edge, state.weights).cost;
    return std::isfinite(cost) ? BucketQueue::bucket_of(cost) : BucketQueue::kNone;
}

std::size_t collapse_queued(CollapseState& state, CollapseWorker& worker, BucketQueue::Bucket limit,
                            std::size_t quota) {
    const CollapseMesh& mesh = state.mesh;
    std::size_t removed = 0;
    std::uint32_t edge = 0;
    BucketQueue::Bucket bucket = 0;
    if (refused_too_many(state, worker)) return 0;
    while (removed < quota && worker.queue.pop(limit, edge, bucket)) {
        if (mesh.removed(edge) || !mesh.is_edge(edge) || !may_collapse(state, edge, worker.zone)) continue;
        const Candidate candidate = edge_cost(mesh, edge, state.weights);
        if (!std::isfinite(candidate.cost)) continue;
        const BucketQueue::Bucket now = BucketQueue::bucket_of(candidate.cost);
        if (now > bucket) {
            worker.queue.push(edge, now);
            continue;
        }
        if (!can_collapse(mesh, edge, candidate.place, worker.around)) continue;
        if (wait(state, worker, edge, now, bucket)) continue;
        if (!within_bound(state, edge, candidate.place, worker.around)) {
            ++worker.refused;
            if (refused_too_many(state, worker)) break;
            continue;
        }
        if (defer(state, worker, edge, candidate, bucket)) continue;
        const std::uint32_t kept = mesh.start(edge);
        collapse(state, edge, candidate.place, worker.around);
        ++removed;
        ++worker.removed;
        constexpr std::size_t kReport = 1024;
        if (state.progress && removed % kReport == 0) report(state, kReport);
        queue_around(state, worker, kept);
    }
    return removed;
}

bool refused_too_many(const CollapseState& state, const CollapseWorker& worker) {
    constexpr std::size_t kFew = 200;  // too few to judge by
    return state.pass.stop_when_refused && worker.refused > worker.removed + kFew;
}

}  // namespace sidewall::simplify
