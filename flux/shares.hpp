#pragma once
#include <cstdint>
#include <functional>
#include <span>

namespace sidewall::flux {

/// Processes (ranks) that share the rays of a trace. All make the same calls with the same arguments in the
/// same order, and each traces its part of the blocks of rays. All end with the bits that one would get.
struct Shares {
    std::uint32_t rank = 0, ranks = 1;
    /// All-reduce: sums a span of equal size over all ranks, element by element and modulo 2^64, and leaves
    /// the sums on all of them. Called only if ranks > 1, by the tracing thread.
    std::function<void(std::span<std::uint64_t>)> sum{};
};

/// The \p value of rank 0, on all ranks; a barrier: none returns before all have called.
inline std::uint64_t of_first(const Shares& shares, std::uint64_t value) {
    if (shares.ranks == 1) return value;
    if (shares.rank != 0) value = 0;
    shares.sum({&value, 1});
    return value;
}

/// Whether all ranks hold the same \p value. All get the same answer.
inline bool all_same(const Shares& shares, std::uint64_t value) {
    if (shares.ranks == 1) return true;
    std::uint64_t differ = of_first(shares, value) != value ? 1 : 0;
    shares.sum({&differ, 1});
    return differ == 0;
}

}  // namespace sidewall::flux
