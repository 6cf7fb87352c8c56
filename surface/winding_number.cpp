#include "surface/winding_number.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace sidewall::surface {
namespace {

constexpr std::uint32_t kLeaf = 8;  // most triangles of a leaf
constexpr double kFar = 3.0;        // distance, in its radii, beyond which a node counts as a dipole

// The solid angle under which a triangle is seen (van Oosterom and Strackee, IEEE T. Biomed. Eng. 30, 1983).
double solid_angle(const std::array<Vec3, 3>& triangle, const Vec3& point) {
    const Vec3 a = triangle[0] - point, b = triangle[1] - point, c = triangle[2] - point;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    return 2.0 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
}

Vec3 middle_of(const std::array<Vec3, 3>& triangle) {
    return (triangle[0] + triangle[1] + triangle[2]) / 3.0;
}

Vec3 half_cross(const std::array<Vec3, 3>& triangle) {
    return 0.5 * (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
}

}  // namespace

WindingNumber::WindingNumber(const TriangleMesh& mesh) {
    triangles_.reserve(mesh.triangles.size());
    for (const auto& [a, b, c] : mesh.triangles)
        triangles_.push_back({mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]});
    if (!triangles_.empty()) build(0, static_cast<std::uint32_t>(triangles_.size()));
}

void WindingNumber::build(std::uint32_t begin, std::uint32_t end) {
    const std::size_t at = nodes_.size();
    nodes_.push_back({.begin = begin, .end = end});
    Node node = nodes_[at];
    Box3 bounds;
    double total = 0.0;
    for (std::uint32_t t = begin; t < end; ++t) {
        const Vec3 middle = middle_of(triangles_[t]), area = half_cross(triangles_[t]);
        bounds.extend(middle);
        node.area += area;
        node.middle += area.norm() * middle;
        total += area.norm();
    }
    node.middle = total > 0.0 ? Vec3(node.middle / total) : bounds.min;
    for (std::uint32_t t = begin; t < end; ++t)
        for (const Vec3& p : triangles_[t]) node.radius = std::max(node.radius, (p - node.middle).norm());
    if (end - begin > kLeaf) {
        Eigen::Index axis = 0;
        bounds.size().maxCoeff(&axis);
        const auto first = triangles_.begin() + begin, half = first + (end - begin) / 2;
        std::nth_element(first, half, triangles_.begin() + end, [&](const auto& s, const auto& t) {
            return middle_of(s)[axis] < middle_of(t)[axis];
        });
        const auto between = static_cast<std::uint32_t>(half - triangles_.begin());
        build(begin, between);
        build(between, end);
    }
    node.skip = static_cast<std::uint32_t>(nodes_.size());
    nodes_[at] = node;
}

double WindingNumber::at(const Vec3& point) const {
    double angle = 0.0;
    for (std::size_t n = 0; n < nodes_.size();) {
        const Node& node = nodes_[n];
        const Vec3 way = node.middle - point;
        const double distance = way.norm();
        const bool far = distance > kFar * node.radius, leaf = n + 1 == node.skip;
        if (far)
            angle += way.dot(node.area) / (distance * distance * distance);
        else if (leaf)
            for (std::uint32_t t = node.begin; t < node.end; ++t) angle += solid_angle(triangles_[t], point);
        n = far || leaf ? node.skip : n + 1;
    }
    return angle / (4.0 * std::numbers::pi);
}

}  // namespace sidewall::surface
