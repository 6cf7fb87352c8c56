#pragma once
#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "simplify/collapse_mesh.hpp"
#include "simplify/deviation.hpp"
#include "simplify/edge_collapse.hpp"
#include "simplify/simplify_options.hpp"

namespace sidewall::simplify {

/// Rules for one pass of edge collapses.
struct CollapsePass {
    double max_length = 0.0;          ///< only edges shorter than this collapse
    std::size_t target_vertices = 0;  ///< the pass ends when no more than this many are left
    bool keep_region = false;         ///< edges with an end in the region do not collapse
    /// Largest distance of input vertices from the simplified mesh, and of its vertices from the input.
    double max_error = kInfinity;
    /// Ends the pass as soon as max_error has refused clearly more edges than have collapsed.
    bool stop_when_refused = false;
    /// Postpones collapses that would leave a point of the input much farther from the surface than recent
    /// ones did: their edges are queued again at twice the cost (see Witness).
    bool defer_outliers = false;
    double length_factor = 1.0;  ///< factor on the graded lengths
};

/// Approximate priority queue of edges. Each power of two of the cost has eight buckets; a bucket is first
/// in, first out. Twice as fast as a heap here, at the same distance to the input. The caller keeps the
/// bucket of every edge in an array; queue entries that disagree with it are stale and skipped.
class BucketQueue {
  public:
    using Bucket = std::uint16_t;
    static constexpr Bucket kNone = 0xffff, kLast = 1023;

    /// \param where  the bucket of every edge, by edge index; kNone if it is not queued.
    explicit BucketQueue(std::span<Bucket> where) : where_(where), buckets_(kLast + 1) {}

    /// Bucket of a cost: its binary exponent, clamped to -64 to 63, and the first three bits of its fraction.
    static Bucket bucket_of(double cost) {
        constexpr std::int32_t kFirst = (127 - 64) << 3;
        const auto bits = static_cast<std::int32_t>(std::bit_cast<std::uint32_t>(static_cast<float>(cost)));
        return static_cast<Bucket>(std::clamp((bits >> 20) - kFirst, 0, std::int32_t{kLast}));
    }

    /// Moves an edge to a bucket; kNone takes it out of the queue.
    void push(std::uint32_t edge, Bucket bucket) {
        if (where_[edge] == bucket) return;
        where_[edge] = bucket;
        if (bucket == kNone) return;
        buckets_[bucket].edges.push_back(edge);
        low_ = std::min(low_, bucket);
    }

    /// Takes the first edge of the lowest bucket up to \p limit.
    /// \returns false if there is none.
    bool pop(Bucket limit, std::uint32_t& edge, Bucket& bucket) {
        for (; low_ <= limit; ++low_) {
            Row& row = buckets_[low_];
            while (row.first < row.edges.size()) {
                edge = row.edges[row.first++];
                if (where_[edge] != low_) continue;
                where_[edge] = kNone;
                bucket = low_;
                return true;
            }
            row.edges.clear();
            row.first = 0;
        }
        return false;
    }

    /// Entries in a bucket, stale ones included.
    std::size_t size(Bucket bucket) const { return buckets_[bucket].edges.size() - buckets_[bucket].first; }

  private:
    struct Row {
        std::vector<std::uint32_t> edges;
        std::size_t first = 0;
    };
    std::span<Bucket> where_;
    std::vector<Row> buckets_;
    Bucket low_ = 0;
};

/// The mesh being coarsened and the rules of the pass, shared by the workers of all blocks.
struct CollapseState {
    static constexpr std::uint32_t kMoved = 0xffffffffu;

    CollapseMesh mesh;
    Weights weights;
    std::function<void(std::size_t)> progress;
    CollapsePass pass;
    double max_length2 = 0.0;      ///< squared max_length of the pass, in units of the scaled mesh
    double max_error = kInfinity;  ///< max_error of the pass, in units of the scaled mesh
    /// Graded and fixed length bounds per vertex, in units of the scaled mesh.
    std::array<std::vector<float>, 2> max_length_at;
    std::vector<std::uint32_t> block;    ///< per vertex: its block in this pass
    std::optional<Deviation> deviation;  ///< made by the first pass with a finite max_error
    std::vector<std::uint32_t> source;   ///< per vertex: input vertex whose position it has, or kMoved
    std::vector<Vec3> witness;           ///< per vertex: a point of the input, see Witness
    std::mutex reporting;
    std::atomic<std::size_t> reported = 0;  ///< vertices left, updated every thousand collapses
};

/// Queue, counts and scratch memory of one worker.
struct CollapseWorker {
    static constexpr std::uint32_t kAnywhere = 0xfffffffeu;  ///< zone that is the whole mesh

    BucketQueue queue;
    std::uint32_t zone;         ///< block whose edges it takes, or kAnywhere
    RecentDistances distances;  ///< starts as the mean of earlier workers
    std::size_t removed = 0;    ///< vertices removed
    std::size_t refused = 0;    ///< edges that the error bound refused
    Surroundings around{};
};

/// Bucket of an edge at its present cost. BucketQueue::kNone if the zone, the constraints or degrees of its
/// ends or its length forbid its collapse in this pass, or if its cost is not finite.
BucketQueue::Bucket queue_bucket(const CollapseState& state, std::uint32_t edge, std::uint32_t zone);

/// Collapses at most \p quota edges of the worker's queue, cheapest first, up to bucket \p limit. An edge
/// whose cost has grown since it was queued is queued again. Only the edges around a collapse are
/// re-evaluated, so that an edge farther away whose cost has dropped keeps its old place.
/// \returns how many vertices it removed.
std::size_t collapse_queued(CollapseState& state, CollapseWorker& worker, BucketQueue::Bucket limit,
                            std::size_t quota);

/// Whether stop_when_refused ends the pass: over 200 more edges were refused than have collapsed.
bool refused_too_many(const CollapseState& state, const CollapseWorker& worker);

}  // namespace sidewall::simplify
