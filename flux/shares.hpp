#pragma once
#include <cstdint>
#include <functional>
#include <span>

namespace sidewall::flux {

/// Processes that share the rays of a trace, its ranks. All of them make the same calls with the same arguments in the
/// same order, each traces blocks of rays of its own, and all end with the same result: the bits of one process.
struct Shares {
    std::uint32_t rank = 0, ranks = 1;
    /// Adds up what all ranks hold in a span of equal size, element by element and modulo 2^64, and leaves the sums with
    /// all of them. Called where ranks > 1 alone, by the thread that traces.
    std::function<void(std::span<std::uint64_t>)> sum{};
};

/// The \p value of rank 0 on all ranks; none returns before all have called.
inline std::uint64_t of_first(const Shares& shares, std::uint64_t value) {
    if (shares.ranks == 1) return value;
    if (shares.rank != 0) value = 0;
    shares.sum({&value, 1});
    return value;
}

/// Whether all ranks hold the same \p value: the same answer on all of them.
inline bool all_same(const Shares& shares, std::uint64_t value) {
    if (shares.ranks == 1) return true;
    std::uint64_t differ = of_first(shares, value) != value ? 1 : 0;
    shares.sum({&differ, 1});
    return differ == 0;
}

}  // namespace sidewall::flux
