// The flux on an open flat plane is 1 by definition.
#include <cmath>
#include <cstdio>

#include "flux/tracer/tracer.hpp"

int main() {
    using namespace sidewall;
    TriangleMesh mesh;
    mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    const surface::RayScene scene(mesh);
    const auto box = flux::lateral_box(mesh, {flux::Boundary::reflective, flux::Boundary::reflective});
    const flux::Species species{"ion", 1.0, {1.0}};
    const auto result =
        flux::trace_flux(mesh, scene, box, species, {}, flux::make_wedges(mesh), {.rays = 10'000});
    std::printf("flux %g and %g\n", result.triangle.flux[0], result.triangle.flux[1]);
    const double mean = 0.5 * (result.triangle.flux[0] + result.triangle.flux[1]);
    return std::abs(mean - 1.0) < 1e-6 && result.leaked == 0 ? 0 : 1;
}
