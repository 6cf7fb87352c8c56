#pragma once
#include <vector>

namespace sidewall::flux {

/// A flux and its standard error, one of each an element. Relative: 1 on an open horizontal plane.
struct FluxField {
    std::vector<double> flux, error;
};

}  // namespace sidewall::flux
