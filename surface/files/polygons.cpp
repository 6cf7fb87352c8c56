#include "surface/files/polygons.hpp"

#include <Eigen/Geometry>
#include <array>
#include <span>

namespace sidewall::surface {
namespace {

constexpr std::size_t kMostCorners = 20'000;

using Point = std::array<double, 2>;

// Twice the signed area of a triangle, positive if it is counter-clockwise.
double turn(const Point& a, const Point& b, const Point& c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

// Triangulates a counter-clockwise polygon by ear clipping: cuts off corners whose triangle holds no other
// corner, one after another. Returns false if no such corner is left.
bool cut_ears(const std::vector<Point>& p, const std::vector<std::uint32_t>& corner,
              std::span<Triangle> triangles) {
    std::vector<std::size_t> left(p.size());  // remaining corners, in order
    for (std::size_t k = 0; k < left.size(); ++k) left[k] = k;
    std::size_t made = 0;
    const auto is_ear = [&](std::size_t at, bool flat) {
        const std::size_t n = left.size();
        const Point &a = p[left[(at + n - 1) % n]], &b = p[left[at]], &c = p[left[(at + 1) % n]];
        const double area = turn(a, b, c);
        if (flat ? area < 0.0 : area <= 0.0) return false;
        return std::none_of(left.begin(), left.end(), [&](std::size_t k) {
            const Point& q = p[k];
            return q != a && q != b && q != c && turn(a, b, q) >= 0.0 && turn(b, c, q) >= 0.0 &&
                   turn(c, a, q) >= 0.0;
        });
    };
    std::size_t at = 0;
    while (left.size() > 3) {
        std::size_t tries = 0;  // first corners of positive area, then flat ones, too
        while (tries < 2 * left.size() && !is_ear(at, tries >= left.size())) {
            at = (at + 1) % left.size();
            ++tries;
        }
        const std::size_t n = left.size();
        if (tries == 2 * n) return false;
        triangles[made++] = {corner[left[(at + n - 1) % n]], corner[left[at]], corner[left[(at + 1) % n]]};
        left.erase(left.begin() + static_cast<std::ptrdiff_t>(at));
        at = (at + 1) % left.size();  // continues elsewhere: no fan of slivers
    }
    triangles[made] = {corner[left[0]], corner[left[1]], corner[left[2]]};
    return turn(p[left[0]], p[left[1]], p[left[2]]) >= 0.0;
}

}  // namespace

void triangulate_polygons(CellTriangles& cells, const std::vector<Vec3>& vertices, const std::string& name) {
    const auto area = [&](const Triangle& t) {
        return Vec3((vertices[t[1]] - vertices[t[0]]).cross(vertices[t[2]] - vertices[t[0]]));
    };
    for (std::size_t begin = 0, end = 0; begin < cells.triangles.size(); begin = end) {
        end = begin + 1;
        while (end < cells.triangles.size() && cells.cell[end] == cells.cell[begin]) ++end;
        const std::span fan(cells.triangles.data() + begin, end - begin);
        if (fan.size() < 2) continue;  // a single triangle
        std::vector<std::uint32_t> corner(fan[0].begin(), fan[0].end());
        for (const Triangle& t : fan.subspan(1))
            if (t[0] == corner[0] && t[1] == corner.back()) corner.push_back(t[2]);
        if (corner.size() != fan.size() + 2) continue;  // from a triangle strip
        if (std::any_of(corner.begin(), corner.end(), [&](auto v) { return v >= vertices.size(); })) continue;
        Vec3 normal = Vec3::Zero();
        for (const Triangle& t : fan) normal += area(t);
        // The vector areas of the two loops of a figure of eight may cancel.
        const bool eight = normal.isZero(0.0) && std::any_of(fan.begin(), fan.end(), [&](const Triangle& t) {
                               return !area(t).isZero(0.0);
                           });
        if (!normal.allFinite() || (!eight && std::all_of(fan.begin(), fan.end(), [&](const Triangle& t) {
                return area(t).dot(normal) >= 0.0;
            })))
            continue;
        Eigen::Index axis = 0;
        normal.cwiseAbs().maxCoeff(&axis);
        const Eigen::Index u = (axis + (normal[axis] > 0.0 ? 1 : 2)) % 3, v = 3 - axis - u;
        std::vector<Point> points;
        points.reserve(corner.size());
        for (const std::uint32_t c : corner) points.push_back({vertices[c][u], vertices[c][v]});
        if (corner.size() > kMostCorners || eight || !cut_ears(points, corner, fan)) {
            const Vec3& p = vertices[corner[0]];
            throw FileError("{}: the polygon of {} corners at ({:g}, {:g}, {:g}) {}: export it as triangles",
                            name, corner.size(), p.x(), p.y(), p.z(),
                            corner.size() > kMostCorners ? "is not convex and too large" : "crosses itself");
        }
    }
}

}  // namespace sidewall::surface
