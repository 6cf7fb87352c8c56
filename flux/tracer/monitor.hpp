#pragma once
#include <algorithm>
#include <atomic>
#include <cstdint>
#include <mutex>

#include "flux/tracer/tracer.hpp"

namespace sidewall::flux {

/// Tells the caller how far a trace is, and asks whether to go on. Thread-safe.
class Monitor {
  public:
    explicit Monitor(const TraceOptions& options) : options_(options) {}
    bool stop() {
        if (!stopped_ && options_.stop && options_.stop()) stopped_ = true;
        return stopped_;
    }
    /// \p rays may change as the trace goes on; the fraction told does not fall.
    void expect(std::uint64_t rays) { rays_ = rays; }
    void finished(std::uint64_t rays) {
        const std::uint64_t done = done_ += rays;
        if (!options_.progress) return;
        const std::unique_lock lock(mutex_, std::try_to_lock);
        if (!lock) return;
        told_ = std::max(told_, std::min(1.0, static_cast<double>(done) / static_cast<double>(rays_)));
        options_.progress(told_);
    }

  private:
    const TraceOptions& options_;
    std::uint64_t rays_ = 1;
    std::atomic<std::uint64_t> done_ = 0;
    std::atomic<bool> stopped_ = false;
    std::mutex mutex_;
    double told_ = 0.0;
};

}  // namespace sidewall::flux
