#include "tests/geometry/self_intersections.hpp"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>

#include <iterator>
#include <utility>
#include <vector>

namespace sidewall::test {

std::size_t self_intersections(const TriangleMesh& mesh) {
    using Point = CGAL::Exact_predicates_inexact_constructions_kernel::Point_3;
    std::vector<Point> points;
    for (const Vec3& p : mesh.vertices) points.emplace_back(p.x(), p.y(), p.z());
    std::vector<std::vector<std::size_t>> triangles;
    for (const Triangle& t : mesh.triangles) triangles.push_back({t[0], t[1], t[2]});
    CGAL::Surface_mesh<Point> surface;
    CGAL::Polygon_mesh_processing::polygon_soup_to_polygon_mesh(points, triangles, surface);
    std::vector<std::pair<CGAL::Surface_mesh<Point>::Face_index, CGAL::Surface_mesh<Point>::Face_index>>
        pairs;
    CGAL::Polygon_mesh_processing::self_intersections(surface, std::back_inserter(pairs));
    return pairs.size();
}

}  // namespace sidewall::test
