#pragma once
#include <cstddef>

namespace sidewall::app {

/// 97.5 % quantile of Student's distribution. \pre degrees >= 1.
double student_quantile(std::size_t degrees);

}  // namespace sidewall::app
