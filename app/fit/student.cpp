#include "app/fit/student.hpp"

#include <boost/math/distributions/students_t.hpp>

namespace sidewall::app {

double student_quantile(std::size_t degrees) {
    // Without long double, which Boost would compute with at the program's start and which valgrind has no
    // more digits for.
    using Policy = boost::math::policies::policy<boost::math::policies::promote_double<false>>;
    constexpr double kUpper = 0.975;
    return quantile(boost::math::students_t_distribution<double, Policy>(static_cast<double>(degrees)),
                    kUpper);
}

}  // namespace sidewall::app
