#pragma once
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cstddef>

namespace sidewall::surface {

/// Calls use(n) for n = 0 .. count - 1 on all threads, in tasks of at least \p grain numbers each.
template <class Use>
void parallel_each(std::size_t count, std::size_t grain, Use&& use) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, grain), [&](const auto& range) {
        for (std::size_t n = range.begin(); n != range.end(); ++n) use(n);
    });
}

}  // namespace sidewall::surface
