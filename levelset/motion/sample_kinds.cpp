#include "levelset/motion/sample_kinds.hpp"

#include <tbb/parallel_reduce.h>

#include <algorithm>

namespace sidewall::levelset {

std::array<std::size_t, kKinds> first_of_kinds(std::span<const std::uint8_t> kind) {
    using First = std::array<std::size_t, kKinds>;
    First none;
    none.fill(kind.size());
    return tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, kind.size(), 16384), none,
        [&](const auto& range, First first) {
            for (std::size_t n = range.end(); n-- > range.begin();)
                first[kind[n]] = std::min(first[kind[n]], n);
            return first;
        },
        [](First a, const First& b) {
            for (std::size_t k = 0; k < kKinds; ++k) a[k] = std::min(a[k], b[k]);
            return a;
        });
}

}  // namespace sidewall::levelset
