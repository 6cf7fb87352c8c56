#include "levelset/domain.hpp"

#include <cmath>

#include "surface/error.hpp"

namespace sidewall::levelset {

Domain make_domain(std::array<double, 2> extent, double spacing, std::array<Side, 2> side) {
    constexpr double kTolerance = 1e-9;      // relative misfit of the second extent
    constexpr double kLargestChange = 0.25;  // relative change of the spacing
    constexpr double kMostCells = 1e6;       // node indices stay far from integer overflow
    if (!(spacing > 0.0) || !std::isfinite(spacing))
        throw RecipeError("domain.grid_spacing = {}: must be positive", spacing);
    for (double e : extent) {
        if (!(e > 0.0) || !std::isfinite(e))
            throw RecipeError("domain.extent = [{}, {}]: both must be positive", extent[0], extent[1]);
        if (e / spacing > kMostCells)
            throw RecipeError(
                "domain.grid_spacing = {}: an extent of {} would need {:.3g} cells; use a larger spacing",
                spacing, e, e / spacing);
    }
    if (spacing > (1.0 + kLargestChange) * std::min(extent[0], extent[1]))
        throw RecipeError("domain.grid_spacing = {}: is larger than the extent [{}, {}]; use a smaller one",
                          spacing, extent[0], extent[1]);
    // The shorter side limits how the spacing can be rounded; try its cell counts from the nearest outwards.
    const std::size_t s = extent[0] <= extent[1] ? 0 : 1;
    const double wanted = extent[s] / spacing;
    const int nearest = std::max(1, static_cast<int>(std::lround(wanted)));
    const int reach = std::max(1, static_cast<int>(nearest * kLargestChange));
    for (int offset = 0; offset <= reach; ++offset) {
        for (int n : {nearest - offset, nearest + offset}) {
            if (n < 1) continue;
            const double dx = extent[s] / n;
            const double other = extent[1 - s] / dx;
            if (std::abs(other - std::round(other)) > kTolerance * other) continue;
            if (std::abs(dx - spacing) > (kLargestChange + kTolerance) * spacing) continue;
            Domain domain;
            domain.spacing = dx;
            domain.side = side;
            for (std::size_t a = 0; a < 2; ++a) {
                domain.cells[a] = static_cast<int>(std::lround(extent[a] / dx));
                domain.min[a] = -0.5 * extent[a];
                domain.max[a] = 0.5 * extent[a];
            }
            return domain;
        }
    }
    throw RecipeError(
        "domain.extent = [{:.10g}, {:.10g}]: no grid spacing near {:.10g} divides both; make one a "
        "whole number of cells of the other, e.g. [{:.10g}, {:.10g}]",
        extent[0], extent[1], spacing, std::round(extent[0] / spacing) * spacing,
        std::round(extent[1] / spacing) * spacing);
}

}  // namespace sidewall::levelset
