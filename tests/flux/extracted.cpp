#include "tests/flux/extracted.hpp"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "simplify/simplify.hpp"
#include "surface/curvature.hpp"
#include "surface/extraction/marching_cubes.hpp"

namespace sidewall::flux {

TriangleMesh extract(std::array<int, 2> first, std::array<int, 2> cells, int low, int high, double dx,
                     const std::function<double(double, double, double)>& phi) {
    const auto grid = openvdb::FloatGrid::create(1.0f);
    auto out = grid->getAccessor();
    for (int i = 0; i <= cells[0]; ++i)
        for (int j = 0; j <= cells[1]; ++j)
            for (int k = low; k <= high; ++k)
                out.setValueOn(openvdb::Coord(i, j, k),
                               static_cast<float>(phi((first[0] + i) * dx, (first[1] + j) * dx, k * dx)));
    const auto at = [&](int axis, int n) { return (first[static_cast<std::size_t>(axis)] + n) * dx; };
    std::vector<const surface::FloatLeaf*> leaves;
    grid->tree().getNodes(leaves);
    TriangleMesh mesh;
    surface::marching_cubes(leaves, {{at(0, 0), at(1, 0)}, {at(0, cells[0]), at(1, cells[1])}, cells, dx},
                            mesh);
    return mesh;
}

// The planes lie on nodes that are just inside the material at the rim and just outside at the foot, so that
// marching cubes cuts corners by no more than its clearance.
TriangleMesh extracted_trench(double depth) {
    constexpr double dx = 0.05;
    return extract({-12, 0}, {24, 16}, -static_cast<int>(std::lround(depth / dx)) - 2, 2, dx,
                   [depth](double x, double, double z) {
                       return std::max(z, std::min(0.5 - std::abs(x), z + depth + 1e-4)) - 1e-7;
                   });
}

std::function<double(double, double, double)> sharp_hole(double depth, double dx) {
    return [depth, drop = 0.01 * dx](double x, double y, double z) {
        const double inside = 1.0 + 1e-7 - std::hypot(x, y);
        return inside > 0.0 ? inside * std::min(1.0, (z + depth) / drop + 1.0)
                            : inside * std::min(1.0, 1.0 - z / drop);
    };
}

TriangleMesh extracted_hole(double depth, int cells) {
    const double dx = 1.0 / cells;
    return extract({0, 0}, {2 * cells, 2 * cells}, -static_cast<int>(std::lround(depth * cells)) - 3, 2, dx,
                   sharp_hole(depth, dx));
}

TriangleMesh simplified(const TriangleMesh& mesh, double dx) {
    simplify::Options options;
    options.method = simplify::Method::region_bounded;
    options.grid_spacing = dx;
    options.l_max = 3.0 * dx;
    options.max_error = 0.02 * dx;
    return simplify::simplify(mesh, surface::feature_flags(mesh, dx), options).mesh;
}

}  // namespace sidewall::flux
