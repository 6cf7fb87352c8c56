#pragma once

namespace sidewall::app {

/// The number of threads in force.
int thread_count();

/// Lets parallel loops use no more than \p count threads from now on; results do not depend on it.
/// \pre count >= 1.
void limit_threads(int count);

}  // namespace sidewall::app
