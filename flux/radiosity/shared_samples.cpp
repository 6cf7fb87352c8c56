#include "flux/radiosity/shared_samples.hpp"

#include <algorithm>
#include <cstring>
#include <type_traits>

namespace sidewall::flux {
namespace {

enum Size : std::size_t { kLinkCount, kExitCount, kSegmentCount, kRescuedCount, kLeakedCount, kCounts };

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

// How much each job found.
std::vector<std::uint64_t> sizes_of(std::span<const Found> found) {
    std::vector<std::uint64_t> sizes;
    sizes.reserve(kCounts * found.size());
    for (const Found& one : found)
        sizes.insert(sizes.end(), {one.links.size(), one.exits.size(), one.flights.segments,
                                   one.flights.rescued, one.leaked});
    return sizes;
}

// Some jobs at once; the first is number \p first.
void share_lists(const Shares& shares, std::span<Found> found, std::size_t first,
                 std::span<const std::uint64_t> sizes) {
    std::size_t total = 0;
    for (std::size_t i = 0; i < found.size(); ++i)
        total +=
            words_of<Link>(sizes[kCounts * i + kLinkCount]) + words_of<Exit>(sizes[kCounts * i + kExitCount]);
    std::vector<std::uint64_t> words(total, 0);
    const auto move = [&](bool own) {
        std::uint64_t* at = words.data();
        for (std::size_t i = 0; i < found.size(); ++i) {
            const std::size_t links = sizes[kCounts * i + kLinkCount],
                              exits = sizes[kCounts * i + kExitCount];
            if (own == ((first + i) % shares.ranks == shares.rank)) {
                std::uint64_t* rest = move_list(found[i].links, links, own, at);
                move_list(found[i].exits, exits, own, rest);
            }
            at += words_of<Link>(links) + words_of<Exit>(exits);
        }
    };
    move(true);
    shares.sum(words);
    move(false);
}

}  // namespace

void share_finds(const Shares& shares, std::span<Found> found) {
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
