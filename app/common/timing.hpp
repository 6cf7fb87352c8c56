#pragma once
#include <tbb/tick_count.h>

#include "app/common/json.hpp"

namespace sidewall::app {

/// Wall-clock seconds by phase of the time loop; its JSON lists the phases in this order.
struct Timing {
    double extract = 0, features = 0, simplify = 0, bvh = 0, trace = 0, rates = 0, extend = 0, advect = 0,
           redistance = 0, output = 0, total = 0;
};

SIDEWALL_JSON(Timing, extract, features, simplify, bvh, trace, rates, extend, advect, redistance, output,
              total)

/// Seconds of a monotonic clock; only differences have a meaning.
double now();

/// CPU seconds of all threads of the process since it began.
double cpu_seconds();

/// Adds the time from its construction to its destruction to a phase.
class PhaseClock {
  public:
    explicit PhaseClock(double& phase) : phase_(phase), start_(tbb::tick_count::now()) {}
    ~PhaseClock() { phase_ += (tbb::tick_count::now() - start_).seconds(); }
    PhaseClock(const PhaseClock&) = delete;
    PhaseClock& operator=(const PhaseClock&) = delete;

  private:
    double& phase_;
    tbb::tick_count start_;
};

}  // namespace sidewall::app
