#include "flux/radiosity/shared_samples.hpp"

#include <algorithm>
#include <cstring>
#include <type_traits>

namespace sidewall::flux {
namespace {

enum Size : std::size_t { kPairCount, kExitCount, kSegmentCount, kRescuedCount, kLeakedCount, kCounts };

template <class T>
std::size_t words_of(std::size_t count) {
    return (count * sizeof(T) + sizeof(std::uint64_t) - 1) / sizeof(std::uint64_t);
}

// Writes a list to \p words, or reads one of \p count from there. \returns the words after it.
template <class T>
std::uint64_t* move_list(std::vector<T>& list, std::size_t count, bool own, std::uint64_t* words) {
    static_assert(std::is_trivially_copyable_v<T>);
    if (!own) list.resize(count);
    if (own && count > 0) std::memcpy(words, list.data(), count * sizeof(T));
    if (!own && count > 0) std::memcpy(list.data(), words, count * sizeof(T));
    return words + words_of<T>(count);
}

// The numbers that each job found.
std::vector<std::uint64_t> sizes_of(std::span<const BlockSamples> found) {
    std::vector<std::uint64_t> sizes;
    sizes.reserve(kCounts * found.size());
    for (const BlockSamples& one : found)
        sizes.insert(sizes.end(), {one.pairs.size(), one.exits.size(), one.flights.segments,
                                   one.flights.rescued, one.leaked});
    return sizes;
}

// Some jobs at once; the first is number \p first.
void share_lists(const Shares& shares, std::span<BlockSamples> found, std::size_t first,
                 std::span<const std::uint64_t> sizes) {
    std::size_t total = 0;
    for (std::size_t i = 0; i < found.size(); ++i)
        total += words_of<PairSample>(sizes[kCounts * i + kPairCount]) +
                 words_of<ExitSample>(sizes[kCounts * i + kExitCount]);
    std::vector<std::uint64_t> words(total, 0);
    const auto move = [&](bool own) {
        std::uint64_t* at = words.data();
        for (std::size_t i = 0; i < found.size(); ++i) {
            const std::size_t pairs = sizes[kCounts * i + kPairCount],
                              exits = sizes[kCounts * i + kExitCount];
            if (own == ((first + i) % shares.ranks == shares.rank)) {
                std::uint64_t* rest = move_list(found[i].pairs, pairs, own, at);
                move_list(found[i].exits, exits, own, rest);
            }
            at += words_of<PairSample>(pairs) + words_of<ExitSample>(exits);
        }
    };
    move(true);
    shares.sum(words);
    move(false);
}

}  // namespace

void share_samples(const Shares& shares, std::span<BlockSamples> found) {
    if (shares.ranks == 1) return;
    std::vector<std::uint64_t> sizes = sizes_of(found);
    shares.sum(sizes);
    constexpr std::size_t kTogether = 512;  // jobs: about 20 MB
    for (std::size_t first = 0; first < found.size(); first += kTogether) {
        const std::size_t count = std::min(kTogether, found.size() - first);
        share_lists(shares, found.subspan(first, count), first,
                    std::span(sizes).subspan(kCounts * first, kCounts * count));
    }
    for (std::size_t i = 0; i < found.size(); ++i) {
        found[i].flights = {sizes[kCounts * i + kSegmentCount], sizes[kCounts * i + kRescuedCount]};
        found[i].leaked = sizes[kCounts * i + kLeakedCount];
    }
}

}  // namespace sidewall::flux
