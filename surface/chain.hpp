#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace sidewall::surface {

/// A directed link between two keyed joints, e.g. a cut segment between two mesh edges.
struct Link {
    std::uint64_t from = 0;
    std::uint64_t to = 0;
};

/// Links in order, each beginning where the one before ends.
struct Chain {
    std::vector<std::uint32_t> links;
    bool closed = false;
};

/// Joins links into chains, every link in exactly one: open chains first, then closed ones, each in the order
/// of its first link. Where several links leave a joint, the lowest unused one goes on. O(n log n).
inline std::vector<Chain> join_links(const std::vector<Link>& links) {
    const auto n = static_cast<std::uint32_t>(links.size());
    std::vector<std::uint32_t> by_start(n);
    for (std::uint32_t i = 0; i < n; ++i) by_start[i] = i;
    std::sort(by_start.begin(), by_start.end(), [&](std::uint32_t a, std::uint32_t b) {
        return links[a].from != links[b].from ? links[a].from < links[b].from : a < b;
    });
    std::vector<std::uint64_t> ends(n);
    for (std::uint32_t i = 0; i < n; ++i) ends[i] = links[i].to;
    std::sort(ends.begin(), ends.end());

    std::vector<std::uint8_t> used(n, 0);
    // Links before this position of a joint's run are used; keeps crowded joints linear.
    std::vector<std::uint32_t> cursor(n, 0);
    const auto next_unused = [&](std::uint64_t joint) -> std::uint32_t {
        const auto first =
            std::lower_bound(by_start.begin(), by_start.end(), joint,
                             [&](std::uint32_t a, std::uint64_t key) { return links[a].from < key; });
        if (first == by_start.end() || links[*first].from != joint) return n;
        const auto base = static_cast<std::uint32_t>(first - by_start.begin());
        for (std::uint32_t i = base + cursor[base]; i < n && links[by_start[i]].from == joint; ++i) {
            if (!used[by_start[i]]) return by_start[i];
            cursor[base] = i + 1 - base;
        }
        return n;
    };

    std::vector<Chain> chains;
    const auto follow = [&](std::uint32_t start) {
        Chain chain;
        for (std::uint32_t i = start; i < n; i = next_unused(links[i].to)) {
            used[i] = 1;
            chain.links.push_back(i);
        }
        chain.closed = links[chain.links.back()].to == links[start].from;
        chains.push_back(std::move(chain));
    };
    for (std::uint32_t i = 0; i < n; ++i)
        if (!used[i] && !std::binary_search(ends.begin(), ends.end(), links[i].from)) follow(i);
    for (std::uint32_t i = 0; i < n; ++i)
        if (!used[i]) follow(i);
    return chains;
}

}  // namespace sidewall::surface
