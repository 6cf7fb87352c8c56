#pragma once
#include <algorithm>
#include <ctime>
#include <vector>

// Timing for the benchmarks.
namespace sidewall::bench {

/// CPU seconds of this process so far.
inline double cpu_seconds() {
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// CPU seconds that \p run takes.
template <class Run>
double cpu_seconds_of(Run&& run) {
    const double start = cpu_seconds();
    run();
    return cpu_seconds() - start;
}

/// Lowers \p seconds to the CPU seconds of \p run if these are fewer.
template <class Run>
void keep_best(double& seconds, Run&& run) {
    seconds = std::min(seconds, cpu_seconds_of(run));
}

/// The upper median. \pre \p values is not empty.
inline double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

}  // namespace sidewall::bench
