#pragma once
#include <algorithm>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

namespace sidewall::simplify {

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

    void push(std::uint32_t edge, Bucket bucket) {
        if (where_[edge] == bucket) return;
        where_[edge] = bucket;
        buckets_[bucket].edges.push_back(edge);
        low_ = std::min(low_, bucket);
    }
    void remove(std::uint32_t edge) { where_[edge] = kNone; }

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

}  // namespace sidewall::simplify
