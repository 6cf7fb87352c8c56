#include "app/accuracy/grid_error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "surface/infinity.hpp"

namespace sidewall::app {
namespace {

constexpr double kSafety = 1.25, kFewSafety = 3.0;   // Roache's, for three grids and for two
constexpr double kLeastOrder = 0.3, kMostOrder = 1;  // that are believed

}  // namespace

GridError grid_error(const std::vector<GridValue>& grids, double least) {
    std::size_t count = 0;  // of the finest grids that have it
    while (count < std::min<std::size_t>(3, grids.size()) &&
           std::isfinite(grids[grids.size() - 1 - count].value))
        ++count;
    if (count == 0) return {kInfinity, "the finest grid does not have it"};
    if (count == 1) return {kInfinity, "only one grid has it"};
    const GridValue &fine = grids[grids.size() - 1], &middle = grids[grids.size() - 2];
    const double ratio = middle.spacing / fine.spacing, last = middle.value - fine.value;
    const double near = std::abs(last) / (ratio - 1.0);  // the error at order 1
    if (count == 2)
        return {std::max(least, kFewSafety * near),
                fmt::format("only two grids have it: their difference counts {:g} times", kFewSafety)};

    const GridValue& coarse = grids[grids.size() - 3];
    const double before = coarse.value - middle.value,
                 on_middle = std::abs(before) / (coarse.spacing / middle.spacing - 1.0),
                 far = on_middle / (ratio * ratio);
    if (last * before < 0.0) {
        const double enclosed = std::max(std::abs(last), std::abs(before) / ratio);
        return {std::max(least, kSafety * enclosed), ""};
    }
    constexpr double kFalling = 0.8;  // order 0.3 on grids of ratio 2
    const bool hidden = std::abs(last) <= std::max(least, fine.noise + middle.noise);
    if (near > kFalling * on_middle && !hidden)
        return {std::max(least, kFewSafety * near), "differences between grids do not fall yet"};
    const double order =
        near > 0.0 ? std::clamp(std::log(on_middle / near) / std::log(ratio), kLeastOrder, kMostOrder)
                   : kMostOrder;
    return {std::max({least, kSafety * std::abs(last) / (std::pow(ratio, order) - 1.0), kSafety * far}), ""};
}

}  // namespace sidewall::app
