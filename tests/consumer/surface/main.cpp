// Writes a tetrahedron, reads it back, and measures how far the two are apart.
#include <cstdio>

#include "surface/distance.hpp"
#include "surface/files/mesh_io.hpp"

int main() {
    using namespace sidewall;
    TriangleMesh mesh;
    mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    surface::write_mesh("tetrahedron.vtp", mesh);
    const TriangleMesh read = surface::read_mesh("tetrahedron.vtp");
    const double distance = surface::two_sided_distance(mesh, read).max;
    std::printf("volume %g, distance %g\n", enclosed_volume(read), distance);
    return read.triangles == mesh.triangles && distance == 0.0 ? 0 : 1;
}
