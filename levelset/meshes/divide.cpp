#include "levelset/meshes/divide.hpp"

#include <algorithm>
#include <array>
#include <unordered_map>
#include <utility>

#include "surface/topology.hpp"

namespace sidewall::levelset {
namespace {

constexpr std::uint32_t kNone = 0xffffffffu;

Vec3 normal_of(const TriangleMesh& mesh, const Triangle& t) {
    const Vec3& a = mesh.vertices[t[0]];
    return (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a);
}

bool keeps_orientation(const TriangleMesh& mesh, const Triangle& t, const EdgePoints& points,
                       double least_cosine) {
    constexpr double kLeastShare = 1e-3;  // of the triangle's area
    const Vec3 normal = normal_of(mesh, t);
    const std::vector<Triangle> parts = parts_of(mesh, t, points);
    return std::all_of(parts.begin(), parts.end(), [&](const Triangle& part) {
        const Vec3 own = normal_of(mesh, part);
        return own.norm() >= kLeastShare * normal.norm() &&
               own.dot(normal) >= least_cosine * own.norm() * normal.norm();
    });
}

// Removes points with which two neighbouring parts lie on each other: they make less than 18 degrees.
// Undivided neighbours of parts count, too. \returns whether there were any.
bool drop_opposites(const TriangleMesh& mesh, EdgePoints& points) {
    constexpr double kOpposite = -0.95;
    std::vector<std::uint8_t> added(mesh.vertices.size(), 0), bad(mesh.vertices.size(), 0);
    for (const auto& [edge, point] : points) added[point] = 1;
    bool any = false;
    std::unordered_map<std::uint64_t, Triangle> at_edge;
    const auto meet = [&](const Triangle& part, bool is_part) {
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint64_t edge = divided_edge(part[k], part[(k + 1) % 3]);
            const auto found = at_edge.find(edge);
            if (found == at_edge.end()) {
                if (is_part) at_edge.emplace(edge, part);
                continue;
            }
            const Vec3 one = normal_of(mesh, part), other = normal_of(mesh, found->second);
            if (one.dot(other) >= kOpposite * one.norm() * other.norm()) continue;
            for (const Triangle& of : {part, found->second})
                for (const std::uint32_t v : of) bad[v] = added[v];
            any = true;
        }
    };
    const std::vector<std::uint8_t> ends = divided_ends(mesh, points);
    std::vector<std::uint8_t> of_parts(mesh.vertices.size(), 0);
    const auto is_divided = [&](const Triangle& t, std::vector<Triangle>& parts) {
        if (is_whole(t, ends)) return false;
        parts = parts_of(mesh, t, points);
        return parts.empty() || parts.front() != t;
    };
    std::vector<Triangle> parts;
    for (const Triangle& t : mesh.triangles) {
        if (!is_divided(t, parts)) continue;
        for (const Triangle& part : parts) {
            meet(part, true);
            for (const std::uint32_t v : part) of_parts[v] = 1;
        }
    }
    // Undivided triangles come last, when all parts are registered.
    for (const Triangle& t : mesh.triangles)
        if (!is_whole(t, of_parts) && !is_divided(t, parts)) meet(t, false);
    if (any) std::erase_if(points, [&](const auto& point) { return bad[point.second] != 0; });
    return any;
}

}  // namespace

std::vector<std::uint8_t> divided_ends(const TriangleMesh& mesh, const EdgePoints& points) {
    std::vector<std::uint8_t> ends(mesh.vertices.size(), 0);
    for (const auto& [edge, point] : points) ends[edge >> 32] = ends[edge & 0xffffffffu] = 1;
    return ends;
}

std::vector<Triangle> parts_of(const TriangleMesh& mesh, const Triangle& t, const EdgePoints& points) {
    std::array<std::uint32_t, 3> point{};  // point k divides the edge from corner k to k + 1
    std::size_t count = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        const auto found = points.find(divided_edge(t[k], t[(k + 1) % 3]));
        point[k] = found == points.end() ? kNone : found->second;
        count += point[k] != kNone;
    }
    std::vector<Triangle> parts;
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        if (a != b && b != c && c != a) parts.push_back({a, b, c});
    };
    if (count == 0) return {t};
    if (count == 3) {
        for (std::size_t k = 0; k < 3; ++k) add(t[k], point[k], point[(k + 2) % 3]);
        add(point[0], point[1], point[2]);
        return parts;
    }
    // Edge k is the only divided one, or the only undivided one.
    std::size_t k = 0;
    while ((point[k] != kNone) != (count == 1)) ++k;
    const std::uint32_t a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3];
    if (count == 1) {
        add(a, point[k], c);
        add(point[k], b, c);
        return parts;
    }
    const std::uint32_t p = point[(k + 1) % 3], q = point[(k + 2) % 3];
    const auto squared = [&](std::uint32_t v, std::uint32_t w) {
        return (mesh.vertices[v] - mesh.vertices[w]).squaredNorm();
    };
    const bool from_a = squared(a, p) < squared(b, q);
    add(p, c, q);
    add(a, b, from_a ? p : q);
    add(from_a ? a : b, p, q);
    return parts;
}

void merge_near(TriangleMesh& mesh, double distance, EdgePoints& points) {
    surface::DisjointSets sets(mesh.vertices.size());
    std::vector<std::uint8_t> triangles(mesh.vertices.size(), 0);  // that share a point; 1: on the boundary
    const std::vector<std::uint8_t> ends = divided_ends(mesh, points);
    for (const Triangle& t : mesh.triangles) {
        if (is_whole(t, ends)) continue;
        std::uint32_t last = kNone;
        for (std::size_t k = 0; k < 3; ++k) {
            const auto found = points.find(divided_edge(t[k], t[(k + 1) % 3]));
            if (found == points.end()) continue;
            const std::uint32_t point = found->second;
            ++triangles[point];
            if (last != kNone && (mesh.vertices[point] - mesh.vertices[last]).norm() < distance)
                sets.join(point, last);
            last = point;
        }
    }
    for (auto& [edge, point] : points) {
        const std::uint32_t own = std::exchange(point, sets.root(point));
        if (triangles[own] == 1) mesh.vertices[point] = mesh.vertices[own];
    }
}

void drop_folds(const TriangleMesh& mesh, double least_cosine, EdgePoints& points) {
    std::vector<std::uint8_t> bad(mesh.vertices.size(), 0);
    const std::vector<std::uint8_t> ends = divided_ends(mesh, points);
    for (const Triangle& t : mesh.triangles) {
        if (is_whole(t, ends) || keeps_orientation(mesh, t, points, least_cosine)) continue;
        for (std::size_t k = 0; k < 3; ++k)
            if (const auto found = points.find(divided_edge(t[k], t[(k + 1) % 3])); found != points.end())
                bad[found->second] = 1;
    }
    std::erase_if(points, [&](const auto& point) { return bad[point.second] != 0; });
    while (drop_opposites(mesh, points)) continue;
}

TriangleMesh divided(const TriangleMesh& mesh, const EdgePoints& points) {
    TriangleMesh result;
    result.triangles.reserve(most_parts(mesh.triangles.size(), points));
    std::vector<std::uint32_t> number(mesh.vertices.size(), kNone);
    const std::vector<std::uint8_t> ends = divided_ends(mesh, points);
    const auto add = [&](const Triangle& t) {
        result.triangles.push_back(t);
        for (const std::uint32_t v : t) number[v] = 0;
    };
    for (const Triangle& t : mesh.triangles) {
        if (is_whole(t, ends))
            add(t);
        else
            for (const Triangle& part : parts_of(mesh, t, points)) add(part);
    }
    result.vertices.reserve(number.size());
    for (const Attribute& attribute : mesh.vertex_attributes)
        result.vertex_attributes.push_back({attribute.name, 1, attribute.type, {}});
    for (std::size_t v = 0; v < number.size(); ++v) {
        if (number[v] == kNone) continue;
        number[v] = static_cast<std::uint32_t>(result.vertices.size());
        result.vertices.push_back(mesh.vertices[v]);
        for (std::size_t k = 0; k < mesh.vertex_attributes.size(); ++k) {
            const std::vector<double>& values = mesh.vertex_attributes[k].values;
            result.vertex_attributes[k].values.push_back(v < values.size() ? values[v] : 0.0);
        }
    }
    for (Triangle& t : result.triangles)
        for (std::uint32_t& v : t) v = number[v];
    return result;
}

}  // namespace sidewall::levelset
