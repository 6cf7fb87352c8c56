// The surface of a trench, extracted from its level set, has the area of top, floor and two walls.
#include <cmath>
#include <cstdio>

#include "levelset/layers/make_stack.hpp"
#include "levelset/meshes/extract.hpp"

int main() {
    using namespace sidewall;
    levelset::initialize();
    const auto domain = levelset::make_domain({4.0, 2.0}, 0.1, {});
    const levelset::Shape trench{.kind = levelset::ShapeKind::trench, .width = 2.0, .depth = 1.0};
    const auto stack = levelset::make_stack(domain, {{0, trench}});
    const TriangleMesh mesh = levelset::extract_surface(stack.top(), domain);
    const double area = total_area(mesh), exact = 4.0 * 2.0 + 2 * 1.0 * 2.0;
    std::printf("%zu triangles, area %g of %g\n", mesh.triangles.size(), area, exact);
    return std::abs(area - exact) < 0.1 * exact ? 0 : 1;
}
