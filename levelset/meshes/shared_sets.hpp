#pragma once
#include <algorithm>
#include <atomic>
#include <cstdint>
#include <vector>

namespace sidewall::levelset {

/// Disjoint sets of 0..n-1 as DisjointSets, that many threads may join at once. Roots point to lower members alone, so that the
/// root is the lowest member, whatever the order of joins (Jayanti and Tarjan, Distributed Computing 34 (2021) 413).
class SharedSets {
  public:
    explicit SharedSets(std::size_t n) : parent_(n) {
        for (std::uint32_t i = 0; i < n; ++i) parent_[i].store(i, std::memory_order_relaxed);
    }
    std::uint32_t root(std::uint32_t i) {
        for (;;) {
            const std::uint32_t parent = parent_[i].load(std::memory_order_relaxed);
            if (parent == i) return i;
            // Halves the path: an ancestor stays one, whoever else writes.
            const std::uint32_t next = parent_[parent].load(std::memory_order_relaxed);
            if (next != parent) parent_[i].store(next, std::memory_order_relaxed);
            i = next;
        }
    }
    void join(std::uint32_t a, std::uint32_t b) {
        // Most pairs are of one set by then, and most of those have one parent.
        if (parent_[a].load(std::memory_order_relaxed) == parent_[b].load(std::memory_order_relaxed)) return;
        for (;;) {
            a = root(a);
            b = root(b);
            if (a == b) return;
            std::uint32_t high = std::max(a, b);
            if (parent_[high].compare_exchange_strong(high, std::min(a, b), std::memory_order_relaxed))
                return;
        }
    }

  private:
    std::vector<std::atomic<std::uint32_t>> parent_;
};

}  // namespace sidewall::levelset
