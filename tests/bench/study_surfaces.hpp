#pragma once
#include <openvdb/openvdb.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "surface/marching_cubes.hpp"

// Surfaces of the sizes that topography simulations trace, as marching cubes extracts them.
namespace sidewall::bench {

/// The zero level of a signed distance (negative inside) over a box centred on 0.
inline TriangleMesh extract(double extent_x, double extent_y, double low, double high, double spacing,
                            const std::function<double(double, double, double)>& distance) {
    const auto nx = static_cast<int>(std::lround(extent_x / spacing));
    const auto ny = static_cast<int>(std::lround(extent_y / spacing));
    const auto grid = openvdb::FloatGrid::create(static_cast<float>(3.0 * spacing));
    auto out = grid->getAccessor();
    const auto at = [&](int n, int cells, double extent) { return -0.5 * extent + extent * n / cells; };
    for (int i = 0; i <= nx; ++i)
        for (int j = 0; j <= ny; ++j)
            for (int k = static_cast<int>(low / spacing) - 3; k <= static_cast<int>(high / spacing) + 3;
                 ++k) {
                const double d = distance(at(i, nx, extent_x), at(j, ny, extent_y), k * spacing);
                if (std::abs(d) < 3.0 * spacing)
                    out.setValueOn(openvdb::Coord(i, j, k), static_cast<float>(d));
            }
    return surface::marching_cubes(
        *grid, {{-0.5 * extent_x, -0.5 * extent_y}, {0.5 * extent_x, 0.5 * extent_y}, {nx, ny}, spacing});
}

/// Low relief: a mesa with rounded corners on a plane. About 71 000 vertices.
inline TriangleMesh low_relief() {
    return extract(24.0, 24.0, 0.0, 3.0, 0.1, [](double x, double y, double z) {
        const double qx = std::abs(x) - 5.6, qy = std::abs(y) - 5.6, qz = z - 2.4;
        const double box = std::hypot(std::max(qx, 0.0), std::max(qy, 0.0), std::max(qz, 0.0)) +
                           std::min(std::max({qx, qy, qz}), 0.0) - 0.4;
        return std::min(box, z);
    });
}

/// Deep: two trenches and four round holes, 1 wide and 10 deep. About 175 000 vertices.
inline TriangleMesh deep_features() {
    return extract(8.0, 8.0, -10.0, 0.0, 8.0 / 144.0, [](double x, double y, double z) {
        double opening = 1e9;  // distance to the features' outline, negative inside them
        for (const double centre : {-3.0, -1.0}) opening = std::min(opening, std::abs(x - centre) - 0.5);
        for (const double cx : {1.0, 3.0})
            for (const double cy : {-2.0, 2.0}) opening = std::min(opening, std::hypot(x - cx, y - cy) - 0.5);
        const double floor = -10.0 - z;  // negative above the floor
        const double hole = std::max(opening, floor) > 0.0
                                ? std::hypot(std::max(opening, 0.0), std::max(floor, 0.0))
                                : std::max(opening, floor);
        return std::max(z, -hole);
    });
}

}  // namespace sidewall::bench
