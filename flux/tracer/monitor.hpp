#pragma once
#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>

namespace sidewall::flux {

/// Reports the progress of a trace to its caller and asks whether to stop. Thread-safe.
class Monitor {
  public:
    /// Keeps references to both functions; either may be empty.
    Monitor(const std::function<void(double)>& progress, const std::function<bool()>& stop)
        : progress_(progress), stop_(stop) {}
    bool stop() {
        if (!stopped_ && stop_ && stop_()) stopped_ = true;
        return stopped_;
    }
    /// Sets the expected number of rays. It may change during the trace; the fraction reported never falls.
    void expect(std::uint64_t rays) { rays_ = rays; }
    void finished(std::uint64_t rays) {
        const std::uint64_t done = done_ += rays;
        if (!progress_) return;
        const std::unique_lock lock(mutex_, std::try_to_lock);
        if (!lock) return;
        reported_ =
            std::max(reported_, std::min(1.0, static_cast<double>(done) / static_cast<double>(rays_)));
        progress_(reported_);
    }

  private:
    const std::function<void(double)>& progress_;
    const std::function<bool()>& stop_;
    std::uint64_t rays_ = 1;
    std::atomic<std::uint64_t> done_ = 0;
    std::atomic<bool> stopped_ = false;
    std::mutex mutex_;
    double reported_ = 0.0;
};

}  // namespace sidewall::flux
