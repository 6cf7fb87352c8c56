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
    bool keep_region = false;         ///< edges with an end in the region stay as they are
    /// No vertex of the input may come to lie farther from the simplified surface, nor the other way round.
    double max_error = kInfinity;
    /// The pass ends as soon as max_error has refused more edges than have collapsed, instead of trying all.
    bool stop_when_refused = false;
    /// A collapse that would leave a point of the input much farther from the surface than recent ones did
    /// waits until others cost twice as much (Witness).
    bool defer_outliers = false;
    double length_factor = 1.0;  ///< applied to the graded lengths
};

/// A priority queue of edges sorted roughly: costs within an eighth of a power of two share a bucket, first
/// in, first out. Twice as fast as a heap here, at the same distance to the input. Where an edge is queued is
/// kept by the caller, in an array over all edges; entries that disagree with it are stale and skipped.
class BucketQueue {
  public:
    using Bucket = std::uint16_t;
    static constexpr Bucket kNone = 0xffff, kLast = 1023;

    /// \p where has an element for every edge id, kNone for those not queued.
    explicit BucketQueue(std::span<Bucket> where) : where_(where), buckets_(kLast + 1) {}

    /// Bucket of a cost: its binary exponent, -64 to 63, and three bits of its fraction.
    static Bucket bucket_of(double cost) {
        constexpr std::int32_t kFirst = (127 - 64) << 3;
        const auto bits = static_cast<std::int32_t>(std::bit_cast<std::uint32_t>(static_cast<float>(cost)));
        return static_cast<Bucket>(std::clamp((bits >> 20) - kFirst, 0, std::int32_t{kLast}));
    }

    /// Queues an edge in a bucket, in place of where it was; kNone takes it out.
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

/// The mesh being coarsened and what a pass asks of it, shared by workers in different blocks.
struct CollapseState {
    static constexpr std::uint32_t kMoved = 0xffffffffu;

    CollapseMesh mesh;
    Weights weights;
    std::function<void(std::size_t)> progress;
    CollapsePass pass;
    double max_length2 = 0.0;                         ///< of the pass, in the mesh's scale
    double max_error = kInfinity;                     ///< likewise
    std::array<std::vector<float>, 2> max_length_at;  ///< per vertex, in its scale: graded, fixed
    std::vector<std::uint32_t> block;                 ///< per vertex: its block in this pass
    std::optional<Deviation> deviation;               ///< once a pass has bounded it
    std::vector<std::uint32_t> source;  ///< per vertex: the one whose input position it has, or kMoved
    std::vector<Vec3> witness;          ///< per vertex, a point of the original
    std::mutex reporting;
    std::atomic<std::size_t> reported = 0;  ///< vertices left, a thousand at a time
};

/// One worker's queue and tallies.
struct CollapseWorker {
    static constexpr std::uint32_t kAnywhere = 0xfffffffeu;  ///< a zone: the whole mesh

    BucketQueue queue;
    std::uint32_t zone;         ///< block whose edges it takes, or kAnywhere
    RecentDistances distances;  ///< begun by those before it
    std::size_t removed = 0;    ///< vertices, in all
    std::size_t refused = 0;    ///< edges, by the error bound
    Surroundings around{};
};

/// Bucket of an edge at its cost now; BucketQueue::kNone if the pass may not collapse it, by what holds its ends,
/// their degrees and its length, or if it has no cost.
BucketQueue::Bucket queue_bucket(const CollapseState& state, std::uint32_t edge, std::uint32_t zone);

/// Collapses edges in the worker's queue up to a bucket, cheapest first, at most \p quota. An edge whose cost has
/// grown since it was queued goes back; one whose cost has sunk, without being next to a collapse, is found late.
/// \returns the vertices removed.
std::size_t collapse_queued(CollapseState& state, CollapseWorker& worker, BucketQueue::Bucket limit,
                            std::size_t quota);

/// Whether, with stop_when_refused, the bound has refused clearly more edges than have collapsed.
bool refused_too_many(const CollapseState& state, const CollapseWorker& worker);

}  // namespace sidewall::simplify
