#include "app/sweep/sobol.hpp"

#include <boost/random/sobol.hpp>

namespace sidewall::app {

double sobol(std::uint32_t index, std::size_t dimension) {
    if (index == 0) return 0.0;
    boost::random::sobol sequence(kSobolDimensions);
    sequence.seed(index - 1);  // Boost leaves the origin out
    sequence.discard(dimension);
    return static_cast<double>(sequence()) * 0x1p-64;
}

}  // namespace sidewall::app
