#include "levelset/motion/speed_classes.hpp"

#include <tbb/parallel_reduce.h>

#include <algorithm>

namespace sidewall::levelset {

std::array<std::size_t, kSpeedClasses> first_of_classes(std::span<const std::uint8_t> speed_class) {
    using First = std::array<std::size_t, kSpeedClasses>;
    First none;
    none.fill(speed_class.size());
    return tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, speed_class.size(), 16384), none,
        [&](const auto& range, First first) {
            for (std::size_t n = range.end(); n-- > range.begin();)
                first[speed_class[n]] = std::min(first[speed_class[n]], n);
            return first;
        },
        [](First a, const First& b) {
            for (std::size_t k = 0; k < kSpeedClasses; ++k) a[k] = std::min(a[k], b[k]);
            return a;
        });
}

}  // namespace sidewall::levelset
