#include "simplify/collapse.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <mutex>
#include <numeric>
#include <optional>

#include "simplify/blocks.hpp"
#include "simplify/bucket_queue.hpp"
#include "simplify/collapse_mesh.hpp"
#include "simplify/deviation.hpp"
#include "simplify/edge_collapse.hpp"
#include "simplify/edge_cost.hpp"
#include "simplify/materials.hpp"
#include "simplify/witness.hpp"
#include "surface/error.hpp"

namespace sidewall::simplify {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::uint32_t kMoved = 0xffffffffu;
constexpr std::uint32_t kAnywhere = 0xfffffffeu;

/// One worker's queue; workers in different blocks share the mesh.
struct Worker {
    Worker(std::span<BucketQueue::Bucket> where, std::uint32_t z, const RecentSteps& s)
        : queue(where), zone(z), steps(s) {}
    BucketQueue queue;
    std::uint32_t zone;       ///< block whose edges it takes, or kAnywhere
    std::size_t removed = 0;  ///< vertices, in all
    std::size_t refused = 0;  ///< edges, by the error bound
    RecentSteps steps;
    Surroundings around;
};

}  // namespace

struct CollapseEngine::Impl {
    const TriangleMesh& input;
    Weights weights;
    CollapseMesh mesh;
    CollapsePass pass;
    double max_length2 = 0.0;                         ///< of the pass, in the mesh's scale
    double max_error = kInfinity;                     ///< likewise
    std::array<std::vector<float>, 2> max_length_at;  ///< per vertex, in its scale: graded, fixed
    std::function<void(std::size_t)> progress;
    std::mutex telling;
    std::atomic<std::size_t> told = 0;   ///< vertices left, a thousand at a time
    std::optional<Deviation> deviation;  ///< once a pass has bounded it
    std::size_t vertices = 0;            ///< left
    std::vector<std::uint32_t> source;   ///< input vertex whose position it has, or kMoved
    std::vector<Vec3> witness;           ///< per vertex, a point of the original
    RecentSteps steps;                   ///< of all workers
    std::vector<BucketQueue::Bucket> where;
    Blocks blocks;

    Impl(const TriangleMesh& m, const Weights& w, std::span<const std::uint8_t> fixed)
        : input(m), weights(w), mesh(m) {
        const std::size_t n = input.vertices.size();
        for (const std::uint32_t h : mesh.leaving) vertices += h != kNoHalfedge;
        const std::vector<std::uint8_t> frozen = frozen_vertices(input, fixed);
        for (std::size_t v = 0; v < n; ++v)
            if (frozen[v]) mesh.state[v].constraint.kind = VertexKind::frozen;
        source.resize(n);
        std::iota(source.begin(), source.end(), 0u);
        witness.resize(n);
        for (std::size_t v = 0; v < n; ++v) witness[v] = mesh.position(static_cast<std::uint32_t>(v));
        where.assign(mesh.corner.size(), BucketQueue::kNone);
    }

    bool transition_edge(std::uint32_t h) const {
        const auto held = [](const VertexState& s) {
            return s.constraint.kind == VertexKind::frozen || (s.flags & kRegion) != 0;
        };
        return !held(mesh.state[mesh.start(h)]) && !held(mesh.state[mesh.end(h)]);
    }

    bool allows(std::uint32_t h, std::uint32_t zone) const {
        const std::uint32_t a = mesh.start(h), b = mesh.end(h);
        if (zone != kAnywhere && (blocks.of[a] != zone || blocks.of[b] != zone)) return false;
        const VertexState &s = mesh.state[a], &e = mesh.state[b];
        if (pass.spare_region && ((s.flags | e.flags) & kRegion)) return false;
        if (s.degree > OneRing::kMost || e.degree > OneRing::kMost) return false;
        if (mesh.merged_place(h) == MergedPlace::nowhere) return false;
        const double length2 = (mesh.position(b) - mesh.position(a)).squaredNorm();
        if (!(length2 < max_length2)) return false;
        double most = kInfinity;
        if (!max_length_at[0].empty())
            most = pass.length_factor * std::min(max_length_at[0][a], max_length_at[0][b]);
        if (!max_length_at[1].empty())
            most = std::min<double>(most, std::min(max_length_at[1][a], max_length_at[1][b]));
        return length2 < most * most;
    }

    /// Queues an edge at its cost now, or takes it out.
    void update(Worker& worker, std::uint32_t h) const {
        const std::uint32_t edge = mesh.edge(h);
        if (allows(edge, worker.zone))
            worker.queue.push(edge, BucketQueue::bucket_of(edge_cost(mesh, edge, weights).cost));
        else
            worker.queue.remove(edge);
    }

    /// Whether all stays within the error bound; can_collapse() has passed.
    bool within_bound(std::uint32_t h, const Vec3& place, Surroundings& s) const {
        return !deviation || deviation->within(max_error, mesh, mesh.start(h), mesh.end(h), place,
                                               std::span(s.moved).first(s.count),
                                               std::span(s.gone).first(s.apexes), s.plan);
    }

    /// Puts an edge off until twice its cost if a collapse would leave a witness far behind; else its start
    /// keeps the farther one. A bound on the error sees to all points itself.
    bool put_off(Worker& worker, std::uint32_t edge, const Candidate& candidate, BucketQueue::Bucket bucket) {
        constexpr int kTwice = 8;
        if (deviation || !pass.spare_outliers) return false;
        const std::uint32_t a = mesh.start(edge), b = mesh.end(edge);
        const double step2 = candidate.area2 > 0.0 ? candidate.swept / candidate.area2 : 0.0;
        worker.steps.add(step2);
        const double limit2 = worker.steps.limit2();
        const Witness farther =
            farther_witness(mesh, candidate.place, std::span(worker.around.moved).first(worker.around.count),
                            witness[a], witness[b], 0.25 * limit2);
        if (farther.distance2 > limit2 && bucket + kTwice <= BucketQueue::kLast) {
            worker.queue.push(edge, static_cast<BucketQueue::Bucket>(bucket + kTwice));
            return true;
        }
        witness[a] = farther.point;
        return false;
    }

    /// Collapses an edge that passed both.
    void collapse(std::uint32_t h, const Vec3& place, const Surroundings& s) {
        const std::uint32_t a = mesh.start(h), b = mesh.end(h);
        source[a] = place == mesh.position(a) ? source[a] : place == mesh.position(b) ? source[b] : kMoved;
        if (deviation)
            deviation->apply(a, std::span(s.moved).first(s.count), std::span(s.gone).first(s.apexes), s.plan);
        for (std::vector<float>& lengths : max_length_at)
            if (!lengths.empty()) lengths[a] = std::min(lengths[a], lengths[b]);
        collapse_edge(mesh, h, place, s);
    }

    bool gives_up(const Worker& worker, std::size_t removed) const {
        constexpr std::size_t kPatience = 200;
        return pass.give_up && worker.refused > worker.removed + removed + kPatience;
    }

    /// Collapses edges up to a bucket, cheapest first, at most \p quota. An edge whose cost has grown since
    /// it was queued goes back; one whose cost has sunk, without being next to a collapse, is found late.
    std::size_t work(Worker& worker, BucketQueue::Bucket limit, std::size_t quota) {
        std::size_t removed = 0;
        std::uint32_t edge = 0;
        BucketQueue::Bucket bucket = 0;
        if (gives_up(worker, 0)) return 0;
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
            if (!within_bound(edge, candidate.place, worker.around)) {
                ++worker.refused;
                if (gives_up(worker, removed)) break;
                continue;
            }
            if (put_off(worker, edge, candidate, bucket)) continue;
            const std::uint32_t kept = mesh.start(edge);
            collapse(edge, candidate.place, worker.around);
            ++removed;
            constexpr std::size_t kTell = 1024;
            if (progress && removed % kTell == 0) tell(kTell);
            OneRing& ring = worker.around.start;
            mesh.ring(kept, ring);
            for (std::uint32_t i = 0; i < ring.triangles; ++i) update(worker, ring.out[i]);
            if (ring.size > ring.triangles)
                update(worker, CollapseMesh::previous(ring.out[ring.triangles - 1]));
        }
        worker.removed += removed;
        return removed;
    }

    /// Tells how many vertices are left; whoever comes while another one tells goes on.
    void tell(std::size_t removed) {
        const std::size_t left = told -= removed;
        if (!telling.try_lock()) return;
        progress(left);
        telling.unlock();
    }

    /// All edges of a worker's zone into its queue.
    void fill(Worker& worker) {
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

    /// Collapses inside of blocks, in parallel, all up to the same cost, until the blocks' share of \p excess
    /// vertices is gone.
    /// \returns how many vertices it removed.
    std::size_t run_blocks(std::size_t excess) {
        blocks = make_blocks(mesh);
        if (blocks.count == 0) return 0;
        std::vector<Worker> workers;
        workers.reserve(blocks.count);
        for (std::uint32_t b = 0; b < blocks.count; ++b) workers.emplace_back(where, b, steps);
        tbb::parallel_for(
            std::uint32_t{0}, blocks.count, [&](std::uint32_t b) { fill(workers[b]); },
            tbb::simple_partitioner{});
        if (pass.target_vertices == 0) {
            tbb::parallel_for(
                std::uint32_t{0}, blocks.count,
                [&](std::uint32_t b) { work(workers[b], BucketQueue::kLast, kMoved); },
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
        for (const Worker& worker : workers) removed += worker.removed;
        steps = {};
        for (const Worker& worker : workers) {
            steps.mean2 += worker.steps.count * worker.steps.mean2;
            steps.count += worker.steps.count;
        }
        if (steps.count > 0.0) steps.mean2 /= steps.count;
        std::fill(where.begin(), where.end(), BucketQueue::kNone);
        return removed;
    }

    /// Lets every block collapse up to the cost below which twice as many edges are queued as vertices are to
    /// go, and no more than half of its own: a collapse takes up to three edges along.
    std::size_t run_round(std::vector<Worker>& workers, std::size_t wanted) {
        BucketQueue::Bucket limit = 0;
        std::size_t queued = 0;
        for (BucketQueue::Bucket b = 0; b <= BucketQueue::kLast; ++b) {
            std::size_t more = 0;
            for (const Worker& worker : workers) more += worker.queue.size(b);
            if (queued > 0 && queued + more > 2 * wanted) break;
            queued += more;
            limit = b;
        }
        std::vector<std::size_t> removed(workers.size(), 0);
        const double part = std::min(
            0.5, static_cast<double>(wanted) / static_cast<double>(std::max<std::size_t>(queued, 1)));
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

    /// Collapses anywhere until the target is met or nothing more can go.
    void run_everywhere() {
        constexpr int kMostSweeps = 20;
        std::vector<BucketQueue::Bucket> bucket(mesh.corner.size());
        for (int sweep = 0; sweep < kMostSweeps && vertices > pass.target_vertices; ++sweep) {
            tbb::parallel_for(std::size_t{0}, bucket.size(), [&](std::size_t i) {
                const auto h = static_cast<std::uint32_t>(i);
                bucket[i] = BucketQueue::kNone;
                if (mesh.removed(h) || !mesh.is_edge(h) || !allows(h, kAnywhere)) return;
                const double cost = edge_cost(mesh, h, weights).cost;
                if (std::isfinite(cost)) bucket[i] = BucketQueue::bucket_of(cost);
            });
            Worker worker(where, kAnywhere, steps);
            for (std::uint32_t h = 0; h < bucket.size(); ++h)
                if (bucket[h] != BucketQueue::kNone) worker.queue.push(h, bucket[h]);
            const std::size_t removed = work(worker, BucketQueue::kLast, vertices - pass.target_vertices);
            vertices -= removed;
            steps = worker.steps;
            std::fill(where.begin(), where.end(), BucketQueue::kNone);
            // A sweep that finds next to nothing is the last one, unless there is a target to meet.
            const bool little = removed * 1000 <= vertices;
            if (removed == 0 || (little && pass.target_vertices == 0) || gives_up(worker, 0)) break;
        }
    }

    void run() {
        max_length2 = pass.max_length * mesh.scale * pass.max_length * mesh.scale;
        max_error = pass.max_error * mesh.scale;
        if (std::isfinite(max_error) && !deviation) deviation.emplace(mesh);
        told = vertices;
        vertices -= run_blocks(vertices - pass.target_vertices);
        run_everywhere();
    }

    template <class Visit>
    void each_edge(const Visit& visit) const {
        for (std::uint32_t h = 0; h < mesh.corner.size(); ++h)
            if (!mesh.removed(h) && mesh.is_edge(h)) visit(h);
    }
    double edge_length(std::uint32_t h) const {
        return (mesh.position(mesh.end(h)) - mesh.position(mesh.start(h))).norm() / mesh.scale;
    }
};

CollapseEngine::CollapseEngine(const TriangleMesh& mesh, const Weights& weights,
                               std::span<const std::uint8_t> fixed)
    : impl_(std::make_unique<Impl>(mesh, weights, fixed)) {}
CollapseEngine::~CollapseEngine() = default;

void CollapseEngine::set_features(std::span<const std::uint8_t> features) {
    const std::size_t n = impl_->input.vertices.size();
    if (features.size() != n)
        throw GeometryError(
            fmt::format("{} feature flags for {} vertices: give one a vertex", features.size(), n));
    for (std::size_t v = 0; v < n; ++v) {
        std::uint8_t& flags = impl_->mesh.state[v].flags;
        flags = static_cast<std::uint8_t>((flags & ~kFeature) | (features[v] != 0 ? kFeature : 0));
    }
    reset_region();
}

void CollapseEngine::reset_region() {
    for (VertexState& state : impl_->mesh.state)
        state.flags =
            static_cast<std::uint8_t>((state.flags & ~kRegion) | (state.flags & kFeature ? kRegion : 0));
}

std::size_t CollapseEngine::grow_region() {
    CollapseMesh& mesh = impl_->mesh;
    std::vector<std::uint32_t> joins;
    impl_->each_edge([&](std::uint32_t h) {
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
    const std::size_t before = impl_->vertices;
    impl_->pass = pass;
    if (before <= pass.target_vertices) return 0;
    impl_->run();
    return before - impl_->vertices;
}

void CollapseEngine::report_to(std::function<void(std::size_t)> progress) {
    impl_->progress = std::move(progress);
}

void CollapseEngine::set_max_lengths(std::span<const double> graded, std::span<const double> fixed) {
    const std::size_t n = impl_->input.vertices.size();
    for (const auto& [lengths, kept] :
         {std::pair{graded, &impl_->max_length_at[0]}, {fixed, &impl_->max_length_at[1]}}) {
        if (lengths.size() != n && !lengths.empty())
            throw GeometryError(
                fmt::format("{} edge lengths for {} vertices: give one a vertex", lengths.size(), n));
        kept->resize(lengths.size());
        for (std::size_t v = 0; v < lengths.size(); ++v)
            (*kept)[v] = static_cast<float>(lengths[v] * impl_->mesh.scale);
    }
}

std::size_t CollapseEngine::vertex_count() const {
    return impl_->vertices;
}

double CollapseEngine::shortest_transition_edge() const {
    double shortest = kInfinity;
    impl_->each_edge([&](std::uint32_t h) {
        if (impl_->transition_edge(h)) shortest = std::min(shortest, impl_->edge_length(h));
    });
    return shortest;
}

double CollapseEngine::longest_transition_edge() const {
    double longest = 0.0;
    impl_->each_edge([&](std::uint32_t h) {
        if (impl_->transition_edge(h)) longest = std::max(longest, impl_->edge_length(h));
    });
    return longest;
}

TriangleMesh CollapseEngine::take_mesh() const {
    const CollapseMesh& mesh = impl_->mesh;
    const TriangleMesh& input = impl_->input;
    const Box3 box = bounding_box(input);
    TriangleMesh result;
    result.vertices.reserve(impl_->vertices);
    std::vector<std::uint32_t> renamed(input.vertices.size(), 0);
    for (std::uint32_t v = 0; v < renamed.size(); ++v) {
        if (mesh.leaving[v] == kNoHalfedge) continue;
        renamed[v] = static_cast<std::uint32_t>(result.vertices.size());
        if (impl_->source[v] != kMoved) {
            result.vertices.push_back(input.vertices[impl_->source[v]]);
            continue;
        }
        // Adding the centre back rounds; the box and its sides must not.
        Vec3 p = mesh.to_world(mesh.position(v)).cwiseMax(box.min).cwiseMin(box.max);
        move_into(mesh.state[v].constraint.planes, p, box.min, box.max);
        result.vertices.push_back(p);
    }
    const Attribute* material = input.triangle_attribute("material");
    if (material) result.triangle_attributes.push_back({material->name, 1, material->type, {}});
    for (std::uint32_t t = 0; t < input.triangles.size(); ++t) {
        if (mesh.removed(3 * t)) continue;
        result.triangles.push_back(
            {renamed[mesh.corner[3 * t]], renamed[mesh.corner[3 * t + 1]], renamed[mesh.corner[3 * t + 2]]});
        if (material) result.triangle_attributes[0].values.push_back(material->values[t]);
    }
    return result;
}

}  // namespace sidewall::simplify
