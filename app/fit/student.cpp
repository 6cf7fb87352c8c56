#include "app/fit/student.hpp"

#include <boost/math/distributions/students_t.hpp>

namespace sidewall::app {

double student_quantile(std::size_t degrees) {
    constexpr double kUpper = 0.975;
    return quantile(boost::math::students_t(static_cast<double>(degrees)), kUpper);
}

}  // namespace sidewall::app
