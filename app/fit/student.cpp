#include "app/fit/student.hpp"

namespace sidewall::app {

// Abramowitz and Stegun, 26.7.5, which is too far off below 3.
double student_quantile(std::size_t degrees) {
    constexpr double kOne = 12.7062, kTwo = 4.3027, z = 1.959964;
    if (degrees <= 1) return kOne;
    if (degrees == 2) return kTwo;
    const double n = static_cast<double>(degrees), z2 = z * z;
    const double g1 = z * (z2 + 1.0) / 4.0;
    const double g2 = z * ((5.0 * z2 + 16.0) * z2 + 3.0) / 96.0;
    const double g3 = z * (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) / 384.0;
    const double g4 = z * ((((79.0 * z2 + 776.0) * z2 + 1482.0) * z2 - 1920.0) * z2 - 945.0) / 92160.0;
    return z + (g1 + (g2 + (g3 + g4 / n) / n) / n) / n;
}

}  // namespace sidewall::app
