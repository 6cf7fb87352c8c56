#pragma once
// The inside of CollapseEngine, shared by the files that implement it: collapse.cpp (what the engine offers),
// collapse_pass.cpp (a pass over the mesh) and collapse_work.cpp (one worker, edge by edge).
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "simplify/blocks.hpp"
#include "simplify/bucket_queue.hpp"
#include "simplify/collapse.hpp"
#include "simplify/collapse_mesh.hpp"
#include "simplify/deviation.hpp"
#include "simplify/edge_collapse.hpp"
#include "simplify/edge_cost.hpp"
#include "simplify/witness.hpp"

namespace sidewall::simplify {

/// One worker's queue; workers in different blocks share the mesh.
struct CollapseWorker {
    static constexpr std::uint32_t kAnywhere = 0xfffffffeu;  ///< a zone: the whole mesh

    CollapseWorker(std::span<BucketQueue::Bucket> where, std::uint32_t z, const RecentDistances& s)
        : queue(where), zone(z), distances(s) {}
    BucketQueue queue;
    std::uint32_t zone;       ///< block whose edges it takes, or kAnywhere
    std::size_t removed = 0;  ///< vertices, in all
    std::size_t refused = 0;  ///< edges, by the error bound
    RecentDistances distances;
    Surroundings around;
};

struct CollapseEngine::Impl {
    static constexpr std::uint32_t kMoved = 0xffffffffu;

    const TriangleMesh& input;
    Weights weights;
    CollapseMesh mesh;
    CollapsePass pass;
    double max_length2 = 0.0;                                    ///< of the pass, in the mesh's scale
    double max_error = std::numeric_limits<double>::infinity();  ///< likewise
    std::array<std::vector<float>, 2> max_length_at;             ///< per vertex, in its scale: graded, fixed
    std::function<void(std::size_t)> progress;
    std::mutex reporting;
    std::atomic<std::size_t> reported = 0;   ///< vertices left, a thousand at a time
    std::optional<Deviation> deviation;      ///< once a pass has bounded it
    std::size_t vertices = 0;                ///< left
    std::vector<std::uint32_t> source;       ///< input vertex whose position it has, or kMoved
    std::vector<Vec3> witness;               ///< per vertex, a point of the original
    RecentDistances distances;               ///< of all workers
    std::vector<BucketQueue::Bucket> where;  ///< per halfedge: bucket its edge is queued in
    Blocks blocks;

    Impl(const TriangleMesh& m, const Weights& w, std::span<const std::uint8_t> fixed);

    // One worker (collapse_work.cpp)

    /// Whether the pass may collapse an edge: what holds its ends, their degrees, its length.
    bool allows(std::uint32_t h, std::uint32_t zone) const;
    /// Queues an edge at its cost now, or takes it out.
    void update(CollapseWorker& worker, std::uint32_t h) const;
    /// Whether all stays within the error bound; can_collapse() has passed.
    bool within_bound(std::uint32_t h, const Vec3& place, Surroundings& s) const;
    /// Queues an edge again at twice its cost if a collapse would leave a witness (witness.hpp) far from the
    /// surface; else its start keeps the farther of the two witnesses. Does nothing under a bound on the
    /// error, which measures all points.
    /// \returns whether it is queued again.
    bool defer(CollapseWorker& worker, std::uint32_t edge, const Candidate& candidate,
               BucketQueue::Bucket bucket);
    /// Under a bound on the error, queues an edge again, at a greater cost the more points of the original keep to
    /// what is around it beyond some thousands: on a flat fan one vertex would take in all others one by one, and
    /// each time all points would be measured.
    /// \returns whether it is queued again.
    bool wait(CollapseWorker& worker, std::uint32_t edge, BucketQueue::Bucket now,
              BucketQueue::Bucket bucket) const;
    /// Collapses an edge that passed can_collapse() and within_bound().
    void collapse(std::uint32_t h, const Vec3& place, const Surroundings& s);
    /// With stop_when_refused: whether the bound has refused clearly more edges than have collapsed. \p
    /// removed are those of the call under way.
    bool refused_too_many(const CollapseWorker& worker, std::size_t removed) const;
    /// Collapses edges up to a bucket, cheapest first, at most \p quota. An edge whose cost has grown since
    /// it was queued goes back; one whose cost has sunk, without being next to a collapse, is found late.
    std::size_t work(CollapseWorker& worker, BucketQueue::Bucket limit, std::size_t quota);
    /// Reports how many vertices are left, unless another thread is doing so just then.
    void report(std::size_t removed);

    // A pass (collapse_pass.cpp)

    /// All edges of a worker's zone into its queue.
    void fill(CollapseWorker& worker);
    /// Collapses inside of blocks, in parallel, all up to the same cost, until the blocks' share of \p excess
    /// vertices is gone.
    /// \returns how many vertices it removed.
    std::size_t run_blocks(std::size_t excess);
    /// Lets every block collapse up to the cost below which twice as many edges are queued as vertices are to
    /// go, and no more than half of its own: a collapse takes up to three edges along.
    std::size_t run_round(std::vector<CollapseWorker>& workers, std::size_t wanted);
    /// Collapses anywhere until the target is met or nothing more can go.
    void run_everywhere();
    /// One pass: blocks first, then the whole mesh.
    void run();

    // What the engine offers (collapse.cpp)

    /// Neither end is frozen or in the region.
    bool transition_edge(std::uint32_t h) const;
    /// In the input's unit.
    double edge_length(std::uint32_t h) const;
    template <class Visit>
    void each_edge(const Visit& visit) const {
        for (std::uint32_t h = 0; h < mesh.corner.size(); ++h)
            if (!mesh.removed(h) && mesh.is_edge(h)) visit(h);
    }
};

}  // namespace sidewall::simplify
